// Scenes whose answer is known in closed form. Each z-score is held to 4.5
// standard errors of the program's own estimate, which for stratified samples is
// an upper one: a false alarm of less than 7e-6 for each check.

#include <doctest/doctest.h>

#include <functional>

#include "support/scenes.h"

using namespace wisp;
using namespace wisp::test;

namespace {

material_data make_material(material_type type, const vec3& color, float roughness = 0) {
  material_data m;
  m.type = type;
  m.color = color;
  m.roughness = roughness;
  return m;
}

material_data clear_hair(float beta_m, float beta_n, float alpha) {
  material_data m;
  m.type = material_type::hair;
  m.hair.sigma_a = vec3{0, 0, 0};
  m.hair.beta_m = beta_m;
  m.hair.beta_n = beta_n;
  m.hair.alpha = alpha;
  return m;
}

// A sphere fills the picture under a sky of radiance 1.
measured furnace(const material_data& material, int samples, int bounces = 64) {
  scene_data scene;
  add_shape(scene, make_sphere(), material);
  add_sky(scene, {1, 1, 1});
  add_ortho_camera(scene, look_at({0, 0, 5}, {0, 0, 0}), 1.3f);
  return measure(std::move(scene), 24, samples, bounces);
}

void check_mean(const measured& m, const vec3& truth, double slack = 1e-5) {
  for (int k = 0; k < 3; k++) {
    CAPTURE(m.mean[k]);
    CAPTURE(truth[k]);
    CAPTURE(m.error);
    CHECK(std::abs(m.mean[k] - double(truth[k])) <
          4.5 * std::sqrt(3.0) * m.error + slack * double(truth[k]));
  }
}

}  // namespace

TEST_CASE("render: furnaces whose every path carries 1 are exactly 1") {
  vec3 white = {1, 1, 1};
  CHECK(furnace(make_material(material_type::matte, white), 4).worst < 1e-4);
  CHECK(furnace(make_material(material_type::reflective, white), 4).worst < 1e-4);
  CHECK(furnace(make_material(material_type::transparent, white), 4, 400).worst < 1e-4);
  CHECK(furnace(make_material(material_type::refractive, white), 4, 400).worst < 2e-3);
}

TEST_CASE("render: a grey matte sphere shows its albedo") {
  check_mean(furnace(make_material(material_type::matte, {0.8f, 0.5f, 0.1f}), 16),
             {0.8f, 0.5f, 0.1f});
}

TEST_CASE("render: interiors that only scatter lose nothing") {
  material_data volume = make_material(material_type::volumetric, {0.5f, 0.5f, 0.5f});
  volume.scattering = {1, 1, 1};
  volume.trdepth = 0.5f;
  check_mean(furnace(volume, 16, 20000), {1, 1, 1}, 1e-3);
  volume.scanisotropy = 0.7f;
  check_mean(furnace(volume, 16, 20000), {1, 1, 1}, 1e-3);
  material_data skin = make_material(material_type::subsurface, {0.5f, 0.5f, 0.5f});
  skin.scattering = {1, 1, 1};
  skin.trdepth = 0.5f;
  check_mean(furnace(skin, 16, 20000), {1, 1, 1}, 1e-2);
}

TEST_CASE("render: rough materials never give more light than they get") {
  for (auto type : {material_type::glossy, material_type::reflective, material_type::transparent,
                    material_type::refractive, material_type::gltfpbr})
    for (float roughness : {0.1f, 0.4f, 0.8f, 1.0f}) {
      measured m = furnace(make_material(type, {1, 1, 1}, roughness), 64);
      CAPTURE(int(type));
      CAPTURE(roughness);
      for (int k = 0; k < 3; k++) {
        CHECK(m.mean[k] < 1 + 4.5 * std::sqrt(3.0) * m.error + 1e-3);
        CHECK(m.mean[k] > 0.1);  // single scattering loses some at high roughness
      }
    }
}

TEST_CASE("render: absorption in an interior follows Beer and Lambert") {
  // Looking straight through a slab of index 1 volumetric matter.
  scene_data scene;
  shape_data slab = make_sphere(128, 1);
  material_data volume = make_material(material_type::volumetric, {0.2f, 0.5f, 1.0f});
  volume.trdepth = 1;
  add_shape(scene, slab, volume);
  add_sky(scene, {1, 1, 1});
  add_ortho_camera(scene, look_at({0, 0.001f, 5}, {0, 0.001f, 0}), 0.02f);
  // The chord is 2: the colour squared. Absorption alone is decided by chance.
  check_mean(measure(std::move(scene), 8, 1024), {0.04f, 0.25f, 1.0f}, 2e-3);
}

TEST_CASE("render: a square lamp above a floor") {
  // Irradiance below the middle of a parallel square of side 2 at distance 1
  // (four equal quadrants): E = L * 4 * F_quadrant * pi with the differential
  // form factor F = (1 / 2 pi) [a / sqrt(1 + a^2) atan(b / sqrt(1 + a^2)) + ...].
  double x = 1 / std::sqrt(2.0);
  double quadrant = (x * std::atan(x) * 2) / (2 * double(pi));
  double irradiance = 5 * double(pi) * 4 * quadrant;
  for (bool tessellated : {false, true}) {
    scene_data scene;
    add_shape(scene, make_square(0.01f), make_material(material_type::matte, {0.5f, 0.5f, 0.5f}));
    shape_data lamp = make_square(1);
    if (tessellated) {  // two triangles, wound to face up: emission is two-sided
      lamp.triangles = {{0, 2, 1}, {0, 3, 2}};
      lamp.quads.clear();
    }
    material_data light = make_material(material_type::matte, {0, 0, 0});
    light.emission = {5, 5, 5};
    add_shape(scene, lamp, light, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 1, 0}});
    // From below the lamp, at a slant.
    add_ortho_camera(scene, look_at({0.5f, 0.3f, 0}, {0, 0, 0}), 0.001f);
    auto expected = float(0.5 / double(pi) * irradiance);
    check_mean(measure(std::move(scene), 8, 256), vec3(expected), 1e-3);
  }
}

TEST_CASE("render: several lamps of different size keep their shares") {
  // Two lamps as above at distances 1 and 2 from two floors' common point.
  auto irradiance = [](double distance, double radiance) {
    double a = 1 / distance, s = a / std::sqrt(1 + a * a);
    return radiance * 4 * s * std::atan(s);
  };
  scene_data scene;
  add_shape(scene, make_square(0.01f), make_material(material_type::matte, {0.5f, 0.5f, 0.5f}));
  for (float distance : {1.0f, -2.0f}) {
    material_data light = make_material(material_type::matte, {0, 0, 0});
    light.emission = vec3(distance > 0 ? 1.0f : 7.0f);
    add_shape(scene, make_square(1), light, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, distance, 0}});
  }
  add_ortho_camera(scene, look_at({0.5f, 0.3f, 0}, {0, 0, 0}), 0.001f);
  auto expected = float(0.5 / double(pi) * irradiance(1, 1));
  check_mean(measure(scene, 8, 256), vec3(expected), 1e-3);
  scene.cameras.clear();
  add_ortho_camera(scene, look_at({0.5f, -0.3f, 0}, {0, 0, 0}), 0.001f);
  expected = float(0.5 / double(pi) * irradiance(2, 7));
  check_mean(measure(scene, 8, 256), vec3(expected), 1e-3);
}

TEST_CASE("render: point, spot and directional lights") {
  auto lit = [](light_data light) {
    scene_data scene;
    add_shape(scene, make_square(0.01f), make_material(material_type::matte, {0.5f, 0.5f, 0.5f}));
    scene.lights.push_back(light);
    add_ortho_camera(scene, look_at({0.5f, 0.5f, 0}, {0, 0, 0}), 0.0001f);
    return measure(std::move(scene), 4, 4).mean.x * double(pi) / 0.5;
  };
  light_data light;
  light.frame = look_at({1, 2, 0}, {0, 0, 0});
  light.intensity = {3, 3, 3};
  double cosine = 2 / std::sqrt(5.0);
  CHECK(lit(light) == doctest::Approx(3 * cosine / 5).epsilon(1e-3));
  light.range = 1;
  CHECK(lit(light) == 0);
  light.range = infinity;
  light.type = light_type::directional;
  CHECK(lit(light) == doctest::Approx(3 * cosine).epsilon(1e-3));
  light.type = light_type::spot;
  light.inner_cone = 0.3f;
  light.outer_cone = 0.5f;
  CHECK(lit(light) == doctest::Approx(3 * cosine / 5).epsilon(1e-3));
  light.frame = look_at({1, 2, 0}, {5, 0, 0});
  CHECK(lit(light) == 0);
}

TEST_CASE("render: an image sky lights as its integral says") {
  // Radiance 1 + 4 in one cap of 30 degrees around the zenith, given as an image,
  // and a floor: E = pi + 4 pi sin^2(30 degrees), with the image's own rows.
  scene_data scene;
  add_shape(scene, make_square(0.01f), make_material(material_type::matte, {0.5f, 0.5f, 0.5f}));
  texture_data sky;
  sky.width = 64;
  sky.height = 48;
  sky.nearest = true;
  sky.pixelsf.assign(64 * 48, vec4(1));
  for (std::size_t j = 0; j < 8; j++)
    for (std::size_t i = 0; i < 64; i++) sky.pixelsf[j * 64 + i] = vec4(5, 5, 5, 1);
  scene.textures.push_back(sky);
  add_sky(scene, {1, 1, 1});
  scene.environments[0].emission_tex = 0;
  add_ortho_camera(scene, look_at({0.5f, 0.5f, 0}, {0, 0, 0}), 0.0001f);
  double irradiance = double(pi) * (1 + 4 * 0.25);
  check_mean(measure(std::move(scene), 8, 256), vec3(float(0.5 / double(pi) * irradiance)), 1e-3);
}

TEST_CASE("render: a matte floor of opacity 0.3 lets the sky and the lamp through") {
  scene_data scene;
  material_data veil = make_material(material_type::matte, {0, 0, 0});
  veil.opacity = 0.3f;
  add_shape(scene, make_square(3), veil, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0.5f, 0}});
  add_shape(scene, make_square(0.01f), make_material(material_type::matte, {0.5f, 0.5f, 0.5f}));
  light_data light;
  light.frame = look_at({0, 2, 0}, {0, 0, 0}, {1, 0, 0});
  light.intensity = {4, 4, 4};
  scene.lights.push_back(light);
  add_ortho_camera(scene, look_at({0.2f, 0.2f, 0}, {0, 0, 0}), 0.0001f);
  // One crossing for the light; the camera is below the veil.
  check_mean(measure(std::move(scene), 4, 64), vec3(float(0.7 * 4 / 4 * 0.5 / double(pi))), 1e-3);
}

TEST_CASE("render: hair that absorbs nothing under a sky of 1 vanishes") {
  for (auto basis :
       {curve_basis::linear, curve_basis::bspline, curve_basis::bezier, curve_basis::catmull_rom})
    for (auto profile : {curve_profile::flat, curve_profile::round}) {
      scene_data scene;
      shape_data hair = make_hair_ball(3000, 0.6f, 0.01f, basis);
      hair.profile = profile;
      add_shape(scene, hair, clear_hair(0.3f, 0.3f, 2));
      add_sky(scene, {1, 1, 1});
      add_ortho_camera(scene, look_at({0, 0, 5}, {0, 0, 0}), 2.5f);
      CAPTURE(int(basis));
      CAPTURE(int(profile));
      measured m = measure(std::move(scene), 24, 16, 4000);
      check_mean(m, {1, 1, 1}, 1e-3);
      CHECK(m.worst < 0.02);
    }
}

TEST_CASE("render: lamp and sky samples agree with scattered rays alone") {
  // A lamp is found by its own samples and by scattered rays; the sum must be what
  // scattered rays alone give. Roulette and weights are the same program's, so the
  // check is against the lamp as part of an image sky and as a mesh.
  scene_data base;
  add_shape(base, make_hair_ball(2000, 0.5f, 0.01f, curve_basis::bspline),
            clear_hair(0.3f, 0.3f, 2));
  base.materials[0].hair.sigma_a = vec3{0.2f, 0.4f, 0.9f};
  add_ortho_camera(base, look_at({0, 0, 5}, {0, 0, 0}), 2.5f);
  scene_data mesh = base, image = base;
  material_data light;
  light.emission = {2, 2, 2};
  // A sphere around everything is a sky.
  add_shape(mesh, make_sphere(256, 100), light);
  add_sky(image, {2, 2, 2});
  measured a = measure(std::move(mesh), 24, 256), b = measure(std::move(image), 24, 256);
  for (int k = 0; k < 3; k++) {
    CAPTURE(a.mean[k]);
    CAPTURE(b.mean[k]);
    CHECK(std::abs(a.mean[k] - b.mean[k]) <
          4.5 * std::sqrt(3.0) * std::hypot(a.error, b.error) + 1e-4);
  }
}
