// Three renderers' interfaces, one hair: each adapter is put into the frames of its
// renderer and must give what wisp gives. Ends with 1 if one does not.

#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <memory>

#include "checks.h"
#include "mitsuba_hair.h"
#include "pbrt_hair.h"
#include "stand_in/yocto_scene.h"

namespace {

// Left of the fibre as the viewer sees it, where h is positive, and towards the viewer.
glm::vec3 left_of(const situation& s) { return glm::normalize(glm::cross(s.wo, s.tangent)); }
glm::vec3 facing(const situation& s) { return glm::cross(s.tangent, left_of(s)); }

// Yocto/GL: world space, and a ray that passes by a line.
scattering through_yocto(const situation& s) {
  using namespace yocto;
  auto to_yocto = [](const glm::vec3& v) { return vec3f{v.x, v.y, v.z}; };
  const glm::vec3 axis = {3, -2, 5};
  const float radius = 0.02f;
  const glm::vec3 origin = axis + left_of(s) * (s.h * radius) + s.tangent * 0.1f + s.wo * 4.0f;
  const ray3f ray = {to_yocto(origin), to_yocto(-s.wo)};
  const vec3f outgoing = -ray.d, normal = to_yocto(facing(s));
  // The renderer keeps it with the material; here it must live as long as the functions.
  const auto bsdf =
      std::make_shared<const wisp::hair::hair_bsdf<float>>(wisp::hair::make_hair_bsdf(s.material));
  material_point material;
  material.type = material_type::hair;
  material.hair = make_hair_point(*bsdf, {s.sigma_a[0], s.sigma_a[1], s.sigma_a[2]}, to_yocto(axis),
                                  to_yocto(s.tangent), radius, ray);

  scattering result;
  result.eval = [=, keep = bsdf](const glm::vec3& w) {
    const vec3f f = eval_bsdfcos(material, normal, outgoing, to_yocto(w));
    return scattering::value{{f.x, f.y, f.z},
                             sample_bsdfcos_pdf(material, normal, outgoing, to_yocto(w))};
  };
  result.draw = [=, keep = bsdf](const glm::vec3& u) {
    const vec3f w = sample_bsdfcos(material, normal, outgoing, u.x, {u.y, u.z});
    const vec3f f = eval_bsdfcos(material, normal, outgoing, w);
    const float pdf = sample_bsdfcos_pdf(material, normal, outgoing, w);
    return scattering::sample{{w.x, w.y, w.z}, {f.x / pdf, f.y / pdf, f.z / pdf}, pdf};
  };
  return result;
}

// pbrt: v across a curve whose normal may be turned to any side, and four wavelengths.
scattering through_pbrt(const situation& s) {
  using namespace pbrt;
  auto to_pbrt = [](const glm::vec3& v) { return Vector3f{v.x, v.y, v.z}; };
  // As a flat curve sets them: dp/dv is dp/du turned in the plane across the ray, along it
  // v grows from 0 to 1, and the normal of both goes with the ray, away from the viewer.
  const glm::vec3 across = glm::normalize(glm::cross(-s.wo, s.tangent));
  const Float v = (1 + s.h * glm::dot(across, left_of(s))) / 2;
  const glm::vec3 n = glm::cross(s.tangent, across);
  // Turned by `roll`, as if it were round or flipped.
  const Vector3f ns = to_pbrt(n * std::cos(s.roll) + across * std::sin(s.roll));
  const Vector3f dpdu = to_pbrt(s.tangent * 2.5f), wo = to_pbrt(s.wo);
  const auto bsdf =
      std::make_shared<const wisp::hair::hair_bsdf<float>>(wisp::hair::make_hair_bsdf(s.material));
  SampledSpectrum sigma_a;
  for (int i = 0; i < NSpectrumSamples; i++) sigma_a[i] = s.sigma_a[static_cast<std::size_t>(i)];
  const auto bxdf = std::make_shared<const WispHairBxDF>(1 - 2 * v, bsdf.get(), sigma_a);
  const BSDF<WispHairBxDF> shading(ns, dpdu, bxdf.get());

  // What an integrator makes of f.
  auto with_cosine = [ns](const SampledSpectrum& f, Vector3f wi, Float scale) {
    std::array<double, 4> result = {};
    for (int i = 0; i < NSpectrumSamples; i++)
      result[static_cast<std::size_t>(i)] = f[i] * AbsDot(wi, ns) * scale;
    return result;
  };
  scattering result;
  result.channels = NSpectrumSamples;
  result.eval = [=, keep = bsdf, keep2 = bxdf](const glm::vec3& w) {
    const Vector3f wi = to_pbrt(w);
    return scattering::value{with_cosine(shading.f(wo, wi), wi, 1), shading.PDF(wo, wi)};
  };
  result.draw = [=, keep = bsdf, keep2 = bxdf](const glm::vec3& u) -> scattering::sample {
    const auto bs = shading.Sample_f(wo, u.x, {u.y, u.z});
    if (!bs) return {};
    return {{bs->wi.x, bs->wi.y, bs->wi.z}, with_cosine(bs->f, bs->wi, 1 / bs->pdf), bs->pdf};
  };
  return result;
}

// Mitsuba: the normal of the round fibre at the hit, y along it.
scattering through_mitsuba(const situation& s) {
  using namespace mitsuba;
  auto to_mitsuba = [](const glm::vec3& v) { return Vector3f{v.x, v.y, v.z}; };
  const glm::vec3 normal = left_of(s) * s.h + facing(s) * std::sqrt(1 - s.h * s.h);
  SurfaceInteraction3f si;
  si.sh_frame = {to_mitsuba(glm::cross(s.tangent, normal)), to_mitsuba(s.tangent),
                 to_mitsuba(normal)};
  si.wi = si.to_local(to_mitsuba(s.wo));
  const std::shared_ptr<const BSDF> bsdf =
      std::make_shared<WispHair>(s.material, Color3f{s.sigma_a[0], s.sigma_a[1], s.sigma_a[2]});
  scattering result;
  result.eval = [=](const glm::vec3& w) {
    const BSDFContext context;
    const Vector3f wo = si.to_local(to_mitsuba(w));
    const auto [f, pdf] = bsdf->eval_pdf(context, si, wo);
    const Color3f again = bsdf->eval(context, si, wo);
    const bool same = again.r() == f.r() && again.g() == f.g() && again.b() == f.b() &&
                      bsdf->pdf(context, si, wo) == pdf;
    return scattering::value{{f.r(), f.g(), f.b()}, same ? pdf : -1};
  };
  result.draw = [=](const glm::vec3& u) {
    const auto [bs, weight] = bsdf->sample(BSDFContext(), si, u.x, {u.y, u.z});
    const Vector3f wi = si.to_world(bs.wo);
    return scattering::sample{
        {wi.x(), wi.y(), wi.z()}, {weight.r(), weight.g(), weight.b()}, bs.pdf};
  };
  return result;
}

}  // namespace

int main() {
  bool good = check_scattering("Yocto/GL", through_yocto);
  good = check_scattering("pbrt-v4", through_pbrt) && good;
  good = check_scattering("Mitsuba 3", through_mitsuba) && good;
  std::printf(good ? "all agree\n" : "an adapter is wrong\n");
  return good ? 0 : 1;
}
