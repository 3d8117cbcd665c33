// wisp's hair as a BSDF of Mitsuba 3, for its scalar variants. Mitsuba calls wi what is
// wo to wisp, and the other way round. In its frame of a `bsplinecurve` y goes along the
// fibre and z is the normal of the round surface, which tells h. eval() includes the
// cosine on both sides.

#pragma once

#include <algorithm>
#include <cmath>

#include "stand_in/mitsuba.h"
#include "wisp/hair/bsdf.h"

namespace mitsuba {

class WispHair final : public BSDF {
 public:
  WispHair(const wisp::hair::hair_parameters<float>& parameters, const Color3f& sigma_a)
      : m_bsdf(wisp::hair::make_hair_bsdf(parameters)),
        m_sigma_a(sigma_a.r(), sigma_a.g(), sigma_a.b()) {
    m_components.push_back(BSDFFlags::Glossy | BSDFFlags::Anisotropic | BSDFFlags::NonSymmetric |
                           BSDFFlags::FrontSide);
    m_flags = m_components[0];
  }

  std::pair<BSDFSample3f, Spectrum> sample(const BSDFContext& ctx, const SurfaceInteraction3f& si,
                                           Float sample1, const Point2f& sample2,
                                           Mask active) const override {
    BSDFSample3f bs;
    if (!is_met(ctx, si, active)) return {bs, Spectrum()};
    const auto s = wisp::hair::sample_hair_with_pdf(
        m_bsdf, hit(si), glm::vec4{sample1, sample2.x(), sample2.y(), 0.5f});
    bs.wo = from_fibre(s.direction);
    bs.pdf = s.pdf;
    bs.sampled_type = +BSDFFlags::Glossy;
    bs.sampled_component = 0;
    return {bs, s.pdf > 0 ? color(s.value / s.pdf) : Spectrum()};
  }

  Spectrum eval(const BSDFContext& ctx, const SurfaceInteraction3f& si, const Vector3f& wo,
                Mask active) const override {
    return eval_pdf(ctx, si, wo, active).first;
  }
  Float pdf(const BSDFContext& ctx, const SurfaceInteraction3f& si, const Vector3f& wo,
            Mask active) const override {
    return eval_pdf(ctx, si, wo, active).second;
  }
  std::pair<Spectrum, Float> eval_pdf(const BSDFContext& ctx, const SurfaceInteraction3f& si,
                                      const Vector3f& wo, Mask active) const override {
    if (!is_met(ctx, si, active)) return {Spectrum(), 0.0f};
    const auto v = wisp::hair::eval_hair_with_pdf(m_bsdf, hit(si), to_fibre(wo));
    return {color(v.value), v.pdf};
  }

 private:
  // Mitsuba's curves are seen from outside only.
  static bool is_met(const BSDFContext& ctx, const SurfaceInteraction3f& si, Mask active) {
    return active && ctx.is_enabled(BSDFFlags::Glossy) && si.wi.z() > 0;
  }
  // A turn of the frame, not a swap of two axes, which would mirror it.
  static glm::vec3 to_fibre(const Vector3f& v) { return {v.y(), -v.x(), v.z()}; }
  static Vector3f from_fibre(const glm::vec3& w) { return {-w.y, w.x, w.z}; }
  static Spectrum color(const glm::vec3& c) { return {c.x, c.y, c.z}; }

  wisp::hair::hair_hit<float> hit(const SurfaceInteraction3f& si) const {
    // The sine of the angle from the normal to the viewer, around the fibre.
    const float across = std::hypot(si.wi.x(), si.wi.z());
    const float h = across > 0 ? std::clamp(si.wi.x() / across, -1.0f, 1.0f) : 0.0f;
    return wisp::hair::make_hair_hit(m_bsdf, m_sigma_a, h, to_fibre(si.wi));
  }

  wisp::hair::hair_bsdf<float> m_bsdf;
  glm::vec3 m_sigma_a;
};

}  // namespace mitsuba
