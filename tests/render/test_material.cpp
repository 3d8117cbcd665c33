// Values of the materials, held against an independent double-precision form of
// the published formulas and against what physics demands.
//
// All random numbers have fixed seeds; where a test is statistical, the rate of
// false alarms of the whole test case is stated.

#include <doctest/doctest.h>

#include <array>

#include "render/material_cases.h"
#include "wisp/core/rng.h"
#include "wisp/core/sampling.h"

using namespace wisp;
using namespace wisp::test;

namespace {

// ---------------------------------------------------------------------------
// The published formulas, in double and as they stand in Yocto/GL: z is up.
// ---------------------------------------------------------------------------

double ggx(double alpha, const dvec3& h) {
  double a2 = alpha * alpha, d = h.z * h.z * (a2 - 1) + 1;
  return h.z > 0 ? a2 / (pi_d * d * d) : 0;
}
double masking(double alpha, const dvec3& v, const dvec3& h) {
  if (v.z * glm::dot(v, h) <= 0) return 0;
  double tan2 = (1 - v.z * v.z) / (v.z * v.z);
  return 2 / (1 + std::sqrt(1 + alpha * alpha * tan2));
}

dvec3 reference(const material_point& m, dvec3 o, dvec3 i) {
  using enum material_type;
  double alpha = double(m.roughness), ior = double(m.ior);
  dvec3 color = dvec3(m.color);
  if (o.z < 0) {
    o.z = -o.z, i.z = -i.z;
    if (bends_light(m)) ior = 1 / ior;
  }
  auto facets = [&](const dvec3& v) {
    dvec3 h = glm::normalize(o + v);
    return ggx(alpha, h) * masking(alpha, o, h) * masking(alpha, v, h) / (4 * o.z);
  };
  if (i.z < 0) {
    if (m.type == transparent) {
      dvec3 v = {i.x, i.y, -i.z};
      return color * ((1 - fresnel(ior, glm::dot(o, glm::normalize(o + v)))) * facets(v));
    }
    if (!bends_light(m)) return {0, 0, 0};
    dvec3 h = glm::normalize(o + ior * i);  // Walter, equation 16 and 21
    if (h.z < 0) h = -h;
    double oh = glm::dot(o, h), ih = glm::dot(i, h), d = oh + ior * ih;
    if (oh <= 0 || ih >= 0) return {0, 0, 0};
    return dvec3(std::abs(oh * ih / (o.z * i.z)) * (1 - fresnel(ior, oh)) * ggx(alpha, h) *
                 masking(alpha, o, h) * masking(alpha, i, h) / (d * d) * std::abs(i.z));
  }
  if (m.type == matte) return color * (i.z / pi_d);
  double oh = glm::dot(o, glm::normalize(o + i));
  if (m.type == glossy)
    return color * ((1 - fresnel(ior, o.z)) * i.z / pi_d) + fresnel(ior, oh) * facets(i);
  if (m.type == reflective) {
    dvec3 f;
    for (int k = 0; k < 3; k++) {
      double r = std::sqrt(color[k]);
      f[k] = fresnel((1 + r) / (1 - r), oh);
    }
    return f * facets(i);
  }
  if (m.type == gltfpbr) {
    double r0 = (ior - 1) * (ior - 1) / ((ior + 1) * (ior + 1)), metal = double(m.metallic);
    dvec3 f0 = glm::mix(dvec3(r0), color, metal);
    auto schlick = [&](double c) { return f0 + (1.0 - f0) * std::pow(1 - c, 5.0); };
    return color * (1 - metal) * (1.0 - schlick(o.z)) * (i.z / pi_d) + schlick(oh) * facets(i);
  }
  return dvec3(fresnel(ior, oh) * facets(i));
}

dvec3 to_local(const vec3& v) {
  return {glm::dot(dvec3(test_frame[0]), dvec3(v)), glm::dot(dvec3(test_frame[1]), dvec3(v)),
          glm::dot(dvec3(test_frame[2]), dvec3(v))};
}

constexpr std::array all_types = {
    material_type::matte,       material_type::glossy,     material_type::reflective,
    material_type::transparent, material_type::refractive, material_type::subsurface,
    material_type::volumetric,  material_type::gltfpbr,    material_type::hair};

}  // namespace

TEST_CASE("material: values are those of the published formulas") {
  rng_state rng = make_rng(1);
  int compared = 0;
  for (const auto& c : rough_cases({0.1f, 0.35f, 1.0f})) {
    vec3 o = outgoing_at(c.cos_o);
    for (int k = 0; k < 500; k++) {
      float x = rand1f(rng), y = rand1f(rng);
      vec3 i = sample_sphere({x, y});
      if (std::abs(glm::dot(i, test_normal)) < 1e-2f) continue;
      dvec3 wanted = reference(c.m, to_local(o), to_local(i));
      vec3 value = eval_bsdf(c.m, test_normal, o, i);
      INFO("type ", int(c.m.type), " alpha ", c.m.roughness, " ior ", c.m.ior, " metallic ",
           c.m.metallic, " cos_o ", c.cos_o);
      for (int ch = 0; ch < 3; ch++) {
        compared += wanted[ch] > 0;
        CHECK(double(value[ch]) == doctest::Approx(wanted[ch]).epsilon(2e-3).scale(1e-3));
      }
    }
  }
  CHECK(compared > 50000);
}

TEST_CASE("material: light goes both ways alike") {
  rng_state rng = make_rng(3);
  const vec3 color = {0.8f, 0.5f, 0.2f};
  int compared = 0;
  for (float alpha : {0.05f, 0.3f, 1.0f})
    for (const auto& m : {make_point(material_type::matte, alpha, 1.5f, color),
                          make_point(material_type::glossy, alpha, 1.5f, {0, 0, 0}),
                          make_point(material_type::reflective, alpha, 1.5f, color),
                          make_point(material_type::transparent, alpha, 1.5f, color),
                          make_point(material_type::refractive, alpha, 1.5f),
                          make_point(material_type::subsurface, alpha, 1.3f),
                          make_point(material_type::gltfpbr, alpha, 1.5f, color, 1)})
      for (int k = 0; k < 2000; k++) {
        float a = rand1f(rng), b = rand1f(rng), c = rand1f(rng);
        float x = rand1f(rng), y = rand1f(rng);
        vec3 o = outgoing_at(0.02 + 0.98 * double(a), 6 * double(b));
        // Half of them where the lobe is.
        vec3 i = k % 2 ? sample_bsdf(m, test_normal, o, c, {x, y}) : sample_sphere({x, y});
        float cos_o = glm::dot(o, test_normal), cos_i = glm::dot(i, test_normal);
        if (std::abs(cos_i) < 0.02f) continue;
        // Non-transmissive normals face the viewer, but need not.
        vec3 f = eval_bsdf(m, test_normal, o, i) / std::abs(cos_i);
        vec3 g = eval_bsdf(m, test_normal, i, o) / std::abs(cos_o);
        // Radiance over the squared index is what is conserved.
        if (bends_light(m) && cos_o * cos_i < 0) f *= m.ior * m.ior;
        INFO("type ", int(m.type), " alpha ", alpha, " cosines ", cos_o, " ", cos_i);
        for (int ch = 0; ch < 3; ch++) {
          compared += f[ch] > 0;
          CHECK(double(f[ch]) == doctest::Approx(double(g[ch])).epsilon(5e-3).scale(1e-3));
        }
      }
  CHECK(compared > 30000);
}

TEST_CASE("material: delta lobes share the light and obey Snell and Fresnel") {
  const vec3 color = {0.8f, 0.5f, 0.2f};
  for (float ior : {0.8f, 1.0f, 1.0005f, 1.33f, 1.5f, 2.4f})
    for (double cos_o : {1.0, 0.7, 0.2, 0.01, -1.0, -0.7, -0.2, -0.01}) {
      vec3 o = outgoing_at(cos_o);
      INFO("ior ", ior, " cos_o ", cos_o);
      for (auto type :
           {material_type::reflective, material_type::transparent, material_type::refractive,
            material_type::subsurface, material_type::volumetric}) {
        auto m = make_point(type, 0, ior, color);
        INFO("type ", int(type));
        REQUIRE(is_delta(m));
        double eta = cos_o < 0 ? 1 / double(ior) : double(ior);
        double light = 0, probability = 0;
        vec3 last = {0, 0, 0};
        for (float rnl : {0.0f, 0.999999f}) {
          vec3 i = sample_delta(m, test_normal, o, rnl);
          if (i == vec3{0, 0, 0} || i == last) continue;
          last = i;
          CHECK(glm::length(i) == doctest::Approx(1).epsilon(1e-5));
          float pdf = sample_delta_pdf(m, test_normal, o, i);
          vec3 value = eval_delta(m, test_normal, o, i);
          CHECK(pdf > 0);
          probability += double(pdf);
          bool crosses = double(glm::dot(i, test_normal)) * cos_o < 0;
          bool bent = bends_light(m) && std::abs(ior - 1) > 1e-3f;
          dvec3 out = dvec3(o), in = dvec3(i), n = dvec3(test_normal);
          dvec3 wanted = crosses && bent ? glm::cross(n, out) / -eta
                                         : glm::cross(n, out) * -1.0;  // Snell: tangents
          CHECK(glm::length(glm::cross(n, in) - wanted) < 1e-5);
          double f = fresnel(type == material_type::transparent ? double(ior) : eta, cos_o);
          double chance = crosses ? 1 - f : f;
          if (type == material_type::reflective || (crosses && !bent && bends_light(m)) ||
              type == material_type::volumetric)
            chance = 1;
          CHECK(double(pdf) == doctest::Approx(chance).epsilon(1e-4));
          light += double(value.x) * (crosses && bent ? eta * eta : 1);
        }
        if (type == material_type::reflective) {
          double r = std::sqrt(0.8);
          CHECK(light == doctest::Approx(fresnel((1 + r) / (1 - r), cos_o)).epsilon(1e-4));
        } else if (type == material_type::transparent) {
          double f = fresnel(double(ior), cos_o);
          CHECK(light == doctest::Approx(f + (1 - f) * 0.8).epsilon(1e-4));
        } else {
          CHECK(light == doctest::Approx(1).epsilon(1e-5));
        }
        CHECK(probability == doctest::Approx(1).epsilon(1e-5));
        // A delta has no density.
        CHECK(eval_bsdf(m, test_normal, o, -o) == vec3{0, 0, 0});
        CHECK(sample_bsdf(m, test_normal, o, 0.5f, {0.5f, 0.5f}) == vec3{0, 0, 0});
        CHECK(sample_bsdf_pdf(m, test_normal, o, -o) == 0);
      }
    }
  // Total internal reflection.
  auto glass = make_point(material_type::refractive, 0, 1.5f);
  vec3 o = outgoing_at(-0.5), i = sample_delta(glass, test_normal, o, 0.999999f);
  CHECK(glm::dot(i, test_normal) < 0);
  CHECK(sample_delta_pdf(glass, test_normal, o, i) == 1);
  CHECK(eval_delta(glass, test_normal, o, i) == vec3{1, 1, 1});
  CHECK(eval_delta(glass, test_normal, o, -i) == vec3{0, 0, 0});
  CHECK(eval_delta(make_point(material_type::reflective, 0), test_normal, o, i) == vec3{1, 1, 1});
}

TEST_CASE("material: an index of 1 lets light through at any roughness") {
  auto m = make_point(material_type::refractive, 0.5f, 1);
  vec3 o = outgoing_at(0.3);
  CHECK(is_delta(m));
  CHECK(sample_delta(m, test_normal, o, 0.5f) == -o);
  CHECK(eval_delta(m, test_normal, o, -o) == vec3{1, 1, 1});
  CHECK(sample_delta_pdf(m, test_normal, o, -o) == 1);
  CHECK(eval_bsdf(m, test_normal, o, -o) == vec3{0, 0, 0});
}

TEST_CASE("material: a million calls give finite values that are not negative") {
  rng_state rng = make_rng(4);
  auto cosine = [&]() -> double {  // every so often next to grazing or straight
    float kind = rand1f(rng);
    double c = double(rand1f(rng)) * 2 - 1;
    if (kind < 0.2f) return c * 1e-4;
    if (kind < 0.3f) return c * 1e-9;
    if (kind < 0.35f) return c < 0 ? -1 : 1;
    if (kind < 0.37f) return 0;
    return c;
  };
  auto good = [](const vec3& v) { return is_finite(v) && v.x >= 0 && v.y >= 0 && v.z >= 0; };
  auto unit = [](const vec3& v) {
    return v == vec3{0, 0, 0} || std::abs(glm::dot(v, v) - 1) < 1e-4f;
  };
  auto color_channel = [&] {
    float kind = rand1f(rng);
    return kind < 0.15f ? 0.0f : kind < 0.3f ? 1.0f : rand1f(rng);
  };
  uint64_t bad = 0, unmatched = 0, scattered = 0;
  for (int k = 0; k < 1000000; k++) {
    material_data data;
    data.type = all_types[rand_index(rng, all_types.size())];
    data.color = {color_channel(), color_channel(), color_channel()};
    data.roughness = rand1f(rng) < 0.2f ? 0.0f : rand1f(rng);
    data.metallic = color_channel();
    data.ior = rand1f(rng) < 0.1f ? 1.0f : 0.5f + 2 * rand1f(rng);
    data.scattering = {color_channel(), color_channel(), color_channel()};
    data.scanisotropy = 2 * color_channel() - 1;
    data.trdepth = rand1f(rng) < 0.01f ? 0.0f : rand1f(rng);
    material_point m = eval_material(data, {}, {0, 0}, {1, 1, 1, 1});
    float x = rand1f(rng), y = rand1f(rng), rnl = rand1f(rng);
    vec3 n = sample_sphere({x, y});
    mat3 frame = basis_from_z(n);
    auto direction = [&] {
      double c = cosine(), s = std::sqrt(1 - c * c), phi = 6.3 * double(rand1f(rng));
      return glm::normalize(frame * vec3(dvec3(s * std::cos(phi), s * std::sin(phi), c)));
    };
    vec3 o = direction();
    x = rand1f(rng), y = rand1f(rng);
    if (rnl < 0.01f) x = y = 0;
    bool delta = is_delta(m);
    vec3 drawn = delta ? sample_delta(m, n, o, rnl) : sample_bsdf(m, n, o, rnl, {x, y});
    bad += !unit(drawn);
    for (vec3 i : {drawn, direction(), -o, o}) {
      vec3 value = eval_bsdf(m, n, o, i);
      float pdf = sample_bsdf_pdf(m, n, o, i);
      vec3 delta_value = eval_delta(m, n, o, i);
      float delta_pdf = sample_delta_pdf(m, n, o, i);
      bad += !good(value) || !(pdf >= 0) || !std::isfinite(pdf) || !good(delta_value) ||
             !(delta_pdf >= 0) || !std::isfinite(delta_pdf);
      // No value where nothing is drawn, and the other way round but for black.
      unmatched +=
          (pdf == 0 && value != vec3{0, 0, 0}) || (delta_pdf == 0 && delta_value != vec3{0, 0, 0});
      if (m.type == material_type::refractive || m.type == material_type::subsurface)
        unmatched += pdf > 1e-20f && value == vec3{0, 0, 0};
      scattered += pdf > 0 || delta_pdf > 0;
    }
    vec3 p = sample_scattering(m, o, {x, y});
    bad += !unit(p) || !good(eval_scattering(m, o, p)) ||
           !std::isfinite(sample_scattering_pdf(m, o, p)) || !(sample_scattering_pdf(m, o, p) > 0);
    float far = rnl < 0.1f ? infinity : rand1f(rng);
    float t = sample_transmittance(m.density, far, x, y);
    bad += !(t >= 0) || !good(eval_transmittance(m.density, t)) ||
           !std::isfinite(sample_transmittance_pdf(m.density, t, far)) ||
           !(sample_transmittance_pdf(m.density, t, far) >= 0);
  }
  CHECK(bad == 0);
  CHECK(unmatched == 0);
  CHECK(scattered > 1500000);
}

TEST_CASE("material: parameters mean what they mean in Yocto/GL") {
  std::vector<texture_data> textures(3);
  for (auto& t : textures) t.width = t.height = 1;
  textures[0].pixelsf = {{0.5f, 0.25f, 1, 0.5f}};
  textures[1].pixelsb = {{9, 51, 204, 99}};  // green 0.2, blue 0.8, not decoded
  textures[2].pixelsb = {{255, 0, 188, 255}};
  material_data data;
  data.type = material_type::gltfpbr;
  data.emission = {2, 4, 6};
  data.color = {0.8f, 0.4f, 0.2f};
  data.opacity = 0.9f;
  data.roughness = 0.5f;
  data.metallic = 0.5f;
  data.ior = 1.4f;
  vec4 vertex = {0.5f, 1, 0.5f, 0.8f};

  auto m = eval_material(data, {}, {0, 0}, {1, 1, 1, 1});
  CHECK(m.color == data.color);
  CHECK(m.emission == data.emission);
  CHECK(m.opacity == data.opacity);
  CHECK(m.roughness == 0.25f);
  CHECK(m.metallic == 0.5f);
  CHECK(m.ior == 1.4f);
  CHECK(m.density == vec3{0, 0, 0});

  data.color_tex = data.emission_tex = 0;
  data.roughness_tex = 1;
  m = eval_material(data, textures, {0.3f, 7}, vertex);
  CHECK(glm::length(m.color - vec3{0.2f, 0.1f, 0.1f}) < 1e-6f);
  CHECK(m.emission == vec3{1, 1, 6});  // vertex colours do not tint it
  CHECK(m.opacity == doctest::Approx(0.9 * 0.5 * 0.8));
  CHECK(m.roughness == doctest::Approx(0.01));
  CHECK(m.metallic == doctest::Approx(0.4));

  // Colour textures of 8 bits are decoded.
  data.color_tex = 2;
  m = eval_material(data, textures, {0, 0}, {1, 1, 1, 1});
  CHECK(m.color.z == doctest::Approx(0.2 * 0.5028865));

  // Interiors: `color` is left after trdepth.
  data = {};
  data.type = material_type::subsurface;
  data.color = {0.5f, 1, 0};
  data.trdepth = 0.2f;
  data.scattering = {1, 0.5f, 0.8f};
  data.scanisotropy = 0.3f;
  data.scattering_tex = 0;
  m = eval_material(data, textures, {0, 0}, {1, 1, 1, 1});
  vec3 left = eval_transmittance(m.density, 0.2f);
  CHECK(glm::length(left - vec3{0.5f, 1, 0.0001f}) < 1e-6f);
  CHECK(m.scattering == vec3{0.5f, 0.125f, 0.8f});
  CHECK(m.scanisotropy == 0.3f);
  CHECK(is_volumetric(m));

  for (auto type : all_types) {
    data = {};
    data.type = type;
    data.roughness = 0.02f;  // below 0.03: a delta, or the least roughness
    m = eval_material(data, {}, {0, 0}, {1, 1, 1, 1});
    using enum material_type;
    bool coated = type == glossy || type == gltfpbr;
    CHECK(m.roughness == (coated ? 0.03f * 0.03f : 0));
    CHECK(is_delta(m) == (type == reflective || type == transparent || type == refractive ||
                          type == subsurface || type == volumetric));
    CHECK(is_transmissive(type) ==
          (type == refractive || type == subsurface || type == volumetric));
    data.roughness = 0.031f;
    m = eval_material(data, {}, {0, 0}, {1, 1, 1, 1});
    CHECK(is_delta(m) == (type == volumetric));
    // Textures that are not there are no textures.
    data.color = {0.5f, 0.5f, 0.5f};
    data.color_tex = data.emission_tex = data.roughness_tex = data.scattering_tex = 12;
    CHECK(eval_material(data, textures, {0, 0}, {1, 1, 1, 1}).color == data.color);
  }

  data = {};
  data.type = material_type::hair;
  data.color = {1, 1, 1};
  data.color_tex = 0;
  data.emission = {1, 2, 3};
  data.opacity = 0.5f;
  data.ior = 1.6f;
  m = eval_material(data, textures, {0, 0}, {1, 0.5f, 1, 1});
  CHECK(m.color == vec3{0.5f, 0.125f, 1});
  CHECK(m.opacity == 0.25f);
  CHECK(m.ior == 1.6f);
  CHECK(m.emission == data.emission);
  CHECK(eval_emission(m, {0, 0, 1}, {0, 0, 1}) == data.emission);
  CHECK(eval_emission(m, {0, 0, 1}, {0, 0, -1}) == data.emission);
}
