// A stand-in for pbrt-v4: the names and signatures that pbrt_hair.h uses (base/bxdf.h,
// util/spectrum.h, util/vecmath.h), and the BSDF that turns directions into the frame of
// a BxDF (bsdf.h).

#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string>

namespace pstd {
using std::optional;
}

namespace pbrt {

using Float = float;
constexpr int NSpectrumSamples = 4;

struct Point2f {
  Float x = 0, y = 0;
  Float operator[](int i) const { return i == 0 ? x : y; }
};
struct Vector3f {
  Float x = 0, y = 0, z = 0;
};
inline Vector3f operator*(Vector3f a, Float s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vector3f operator+(Vector3f a, Vector3f b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Float Dot(Vector3f a, Vector3f b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Float AbsDot(Vector3f a, Vector3f b) { return std::abs(Dot(a, b)); }
inline Vector3f Cross(Vector3f a, Vector3f b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Vector3f Normalize(Vector3f a) { return a * (1 / std::sqrt(Dot(a, a))); }
inline Float AbsCosTheta(Vector3f w) { return std::abs(w.z); }

class SampledSpectrum {
 public:
  SampledSpectrum() = default;
  explicit SampledSpectrum(Float c) { values_.fill(c); }
  Float operator[](int i) const { return values_[static_cast<std::size_t>(i)]; }
  Float& operator[](int i) { return values_[static_cast<std::size_t>(i)]; }
  explicit operator bool() const {
    for (Float v : values_)
      if (v != 0) return true;
    return false;
  }

 private:
  std::array<Float, NSpectrumSamples> values_ = {};
};

enum class TransportMode { Radiance, Importance };

enum class BxDFReflTransFlags {
  Unset = 0,
  Reflection = 1 << 0,
  Transmission = 1 << 1,
  All = Reflection | Transmission
};
inline int operator&(BxDFReflTransFlags a, BxDFReflTransFlags b) {
  return static_cast<int>(a) & static_cast<int>(b);
}

enum BxDFFlags {
  Unset = 0,
  Reflection = 1 << 0,
  Transmission = 1 << 1,
  Diffuse = 1 << 2,
  Glossy = 1 << 3,
  Specular = 1 << 4,
  GlossyReflection = Glossy | Reflection
};

struct BSDFSample {
  BSDFSample(SampledSpectrum f_, Vector3f wi_, Float pdf_, BxDFFlags flags_)
      : f(f_), wi(wi_), pdf(pdf_), flags(flags_) {}
  SampledSpectrum f;
  Vector3f wi;
  Float pdf = 0;
  BxDFFlags flags;
};

struct Frame {
  Vector3f x, y, z;
  static Frame FromXZ(Vector3f x, Vector3f z) { return {x, Cross(z, x), z}; }
  Vector3f ToLocal(Vector3f v) const { return {Dot(v, x), Dot(v, y), Dot(v, z)}; }
  Vector3f FromLocal(Vector3f v) const { return x * v.x + y * v.y + z * v.z; }
};

// pbrt dispatches over a pointer with a tag; here it is a template.
template <typename BxDF>
class BSDF {
 public:
  BSDF(Vector3f ns, Vector3f dpdus, const BxDF* bxdf)
      : bxdf_(bxdf), frame_(Frame::FromXZ(Normalize(dpdus), ns)) {}

  SampledSpectrum f(Vector3f woRender, Vector3f wiRender,
                    TransportMode mode = TransportMode::Radiance) const {
    Vector3f wi = frame_.ToLocal(wiRender), wo = frame_.ToLocal(woRender);
    return wo.z == 0 ? SampledSpectrum() : bxdf_->f(wo, wi, mode);
  }
  pstd::optional<BSDFSample> Sample_f(
      Vector3f woRender, Float u, Point2f u2, TransportMode mode = TransportMode::Radiance,
      BxDFReflTransFlags sampleFlags = BxDFReflTransFlags::All) const {
    Vector3f wo = frame_.ToLocal(woRender);
    if (wo.z == 0) return {};
    pstd::optional<BSDFSample> bs = bxdf_->Sample_f(wo, u, u2, mode, sampleFlags);
    if (!bs || !bs->f || bs->pdf == 0 || bs->wi.z == 0) return {};
    bs->wi = frame_.FromLocal(bs->wi);
    return bs;
  }
  Float PDF(Vector3f woRender, Vector3f wiRender, TransportMode mode = TransportMode::Radiance,
            BxDFReflTransFlags sampleFlags = BxDFReflTransFlags::All) const {
    Vector3f wo = frame_.ToLocal(woRender), wi = frame_.ToLocal(wiRender);
    return wo.z == 0 ? 0 : bxdf_->PDF(wo, wi, mode, sampleFlags);
  }

 private:
  const BxDF* bxdf_;
  Frame frame_;
};

}  // namespace pbrt
