// A stand-in for Mitsuba 3 in its variant scalar_rgb: the names and signatures that
// mitsuba_hair.h uses (render/bsdf.h, render/interaction.h, core/frame.h). In Mitsuba
// they are templates over Float and Spectrum.

#pragma once

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace mitsuba {

using Float = float;
using Mask = bool;

struct Point2f {
  Float x_ = 0, y_ = 0;
  Float x() const { return x_; }
  Float y() const { return y_; }
};
struct Vector3f {
  Float x_ = 0, y_ = 0, z_ = 0;
  Float x() const { return x_; }
  Float y() const { return y_; }
  Float z() const { return z_; }
};
struct Color3f {
  Float r_ = 0, g_ = 0, b_ = 0;
  Float r() const { return r_; }
  Float g() const { return g_; }
  Float b() const { return b_; }
};
using Spectrum = Color3f;

inline Vector3f operator*(const Vector3f& a, Float s) { return {a.x_ * s, a.y_ * s, a.z_ * s}; }
inline Vector3f operator+(const Vector3f& a, const Vector3f& b) {
  return {a.x_ + b.x_, a.y_ + b.y_, a.z_ + b.z_};
}
inline Float dot(const Vector3f& a, const Vector3f& b) {
  return a.x_ * b.x_ + a.y_ * b.y_ + a.z_ * b.z_;
}

struct Frame3f {
  Vector3f s, t, n;
  Vector3f to_local(const Vector3f& v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
  Vector3f to_world(const Vector3f& v) const { return s * v.x_ + t * v.y_ + n * v.z_; }
};

struct SurfaceInteraction3f {
  Frame3f sh_frame;
  Vector3f wi;  // towards the viewer, in the frame
  Vector3f to_local(const Vector3f& v) const { return sh_frame.to_local(v); }
  Vector3f to_world(const Vector3f& v) const { return sh_frame.to_world(v); }
};

enum class TransportMode : uint32_t { Radiance, Importance };

enum class BSDFFlags : uint32_t {
  Empty = 0,
  GlossyReflection = 0x8,
  GlossyTransmission = 0x10,
  Anisotropic = 0x1000,
  NonSymmetric = 0x4000,
  FrontSide = 0x8000,
  Glossy = GlossyReflection | GlossyTransmission
};
constexpr uint32_t operator|(BSDFFlags a, BSDFFlags b) {
  return static_cast<uint32_t>(a) | static_cast<uint32_t>(b);
}
constexpr uint32_t operator|(uint32_t a, BSDFFlags b) { return a | static_cast<uint32_t>(b); }
constexpr uint32_t operator+(BSDFFlags a) { return static_cast<uint32_t>(a); }

struct BSDFContext {
  TransportMode mode = TransportMode::Radiance;
  uint32_t type_mask = 0x1ffu;
  uint32_t component = static_cast<uint32_t>(-1);
  bool is_enabled(BSDFFlags type, uint32_t component_ = 0) const {
    return (type_mask == static_cast<uint32_t>(-1) || (type_mask & +type) == +type) &&
           (component == static_cast<uint32_t>(-1) || component == component_);
  }
};

struct BSDFSample3f {
  Vector3f wo;
  Float pdf = 0, eta = 1;
  uint32_t sampled_type = 0, sampled_component = static_cast<uint32_t>(-1);
};

class BSDF {
 public:
  virtual ~BSDF() = default;
  virtual std::pair<BSDFSample3f, Spectrum> sample(const BSDFContext& ctx,
                                                   const SurfaceInteraction3f& si, Float sample1,
                                                   const Point2f& sample2,
                                                   Mask active = true) const = 0;
  virtual Spectrum eval(const BSDFContext& ctx, const SurfaceInteraction3f& si, const Vector3f& wo,
                        Mask active = true) const = 0;
  virtual Float pdf(const BSDFContext& ctx, const SurfaceInteraction3f& si, const Vector3f& wo,
                    Mask active = true) const = 0;
  virtual std::pair<Spectrum, Float> eval_pdf(const BSDFContext& ctx,
                                              const SurfaceInteraction3f& si, const Vector3f& wo,
                                              Mask active = true) const = 0;

 protected:
  uint32_t m_flags = 0;
  std::vector<uint32_t> m_components;
};

}  // namespace mitsuba
