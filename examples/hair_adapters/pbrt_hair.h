// wisp's hair as a BxDF of pbrt-v4, for the CPU. pbrt's frame of a curve is wisp's: x is
// dp/du, along the fibre, and z the shading normal. Its f is without the cosine, which
// its integrators multiply by: |cos| to that normal, above and below.

#pragma once

#include <algorithm>
#include <array>

#include "stand_in/pbrt.h"
#include "wisp/hair/bsdf.h"

namespace pbrt {

class WispHairBxDF {
 public:
  // h = 1 - 2 * ctx.uv[1]: v of pbrt's curves grows to the viewer's right, the tip being up.
  // pbrt's own hair takes -1 + 2 v, a fibre's mirror image, which many fibres do not show.
  // `bsdf` is the material's.
  WispHairBxDF(Float h, const wisp::hair::hair_bsdf<float>* bsdf, SampledSpectrum sigma_a)
      : h_(h), bsdf_(bsdf), sigma_a_(sigma_a) {}

  BxDFFlags Flags() const { return BxDFFlags::GlossyReflection; }
  void Regularize() {}
  std::string ToString() const { return "[ WispHairBxDF ]"; }

  SampledSpectrum f(Vector3f wo, Vector3f wi, TransportMode) const { return Eval(Hits(wo), wi).f; }

  pstd::optional<BSDFSample> Sample_f(
      Vector3f wo, Float uc, Point2f u, TransportMode = TransportMode::Radiance,
      BxDFReflTransFlags sampleFlags = BxDFReflTransFlags::All) const {
    if (!(sampleFlags & BxDFReflTransFlags::Reflection)) return {};
    // A wavelength at random, whose three draw; uc is used again for what is left of it.
    const auto hits = Hits(wo);
    const int g = std::min(static_cast<int>(uc * NSpectrumSamples), NSpectrumSamples - 1) / 3;
    const float rest = (uc - static_cast<float>(3 * g) / NSpectrumSamples) / Share(g);
    const glm::vec3 w = wisp::hair::sample_hair(
        *bsdf_, hits[static_cast<std::size_t>(g)],
        glm::vec4{std::clamp(rest, 0.0f, 0x1.fffffep-1f), u[0], u[1], 0.5f});
    const Vector3f wi = {w.x, w.y, w.z};
    const Value value = Eval(hits, wi);
    if (!(value.pdf > 0)) return {};
    return BSDFSample(value.f, wi, value.pdf, Flags());
  }

  Float PDF(Vector3f wo, Vector3f wi, TransportMode,
            BxDFReflTransFlags sampleFlags = BxDFReflTransFlags::All) const {
    if (!(sampleFlags & BxDFReflTransFlags::Reflection)) return 0;
    return Eval(Hits(wo), wi).pdf;
  }

 private:
  // wisp works on three channels, pbrt on as many wavelengths as it likes: three at a
  // time, and directions by the mean of their densities.
  static constexpr int groups = (NSpectrumSamples + 2) / 3;
  using HairHits = std::array<wisp::hair::hair_hit<float>, groups>;
  static float Share(int g) {
    return static_cast<float>(std::min(3, NSpectrumSamples - 3 * g)) / NSpectrumSamples;
  }

  HairHits Hits(Vector3f wo) const {
    HairHits hits;
    for (int g = 0; g < groups; g++) {
      glm::vec3 sigma_a;
      for (int k = 0; k < 3; k++) sigma_a[k] = sigma_a_[std::min(3 * g + k, NSpectrumSamples - 1)];
      hits[static_cast<std::size_t>(g)] =
          wisp::hair::make_hair_hit(*bsdf_, sigma_a, h_, glm::vec3{wo.x, wo.y, wo.z});
    }
    return hits;
  }

  struct Value {
    SampledSpectrum f;
    Float pdf = 0;
  };
  Value Eval(const HairHits& hits, Vector3f wi) const {
    const Float cosine = AbsCosTheta(wi);
    Value result;
    for (int g = 0; g < groups; g++) {
      const auto v = wisp::hair::eval_hair_with_pdf(*bsdf_, hits[static_cast<std::size_t>(g)],
                                                    glm::vec3{wi.x, wi.y, wi.z});
      for (int k = 0; k < 3 && 3 * g + k < NSpectrumSamples; k++)
        result.f[3 * g + k] = cosine > 0 ? v.value[k] / cosine : 0;
      result.pdf += Share(g) * v.pdf;
    }
    return result;
  }

  Float h_;
  const wisp::hair::hair_bsdf<float>* bsdf_;
  SampledSpectrum sigma_a_;
};

}  // namespace pbrt
