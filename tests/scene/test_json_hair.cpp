#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "json_folder.h"
#include "wisp/hair/materials.h"
#include "wisp/scene/io.h"

using namespace wisp;
using namespace json_test;

TEST_CASE("scene json: hair materials") {
  scene_folder folder;
  auto hair = [&](const std::string& keys) {
    return folder.load(material(R"("type": "hair")" + keys)).materials[0].hair;
  };
  auto h = hair("");
  CHECK(!h.sigma_a);
  CHECK(!h.color);
  CHECK(h.eumelanin == 1.3f);
  CHECK(h.eta == 1.55f);
  h = hair(R"(, "eumelanin": 0.5, "pheomelanin": 0.25, "pigment": "cycles", "eta": 1.4,
            "beta_m": 0.1, "beta_n": 0.9, "alpha": 3)");
  CHECK(h.eumelanin == 0.5f);
  CHECK(h.pheomelanin == 0.25f);
  CHECK(h.pigment == hair_pigment::cycles);
  CHECK(h.eta == 1.4f);
  CHECK(h.beta_m == 0.1f);
  CHECK(h.beta_n == 0.9f);
  CHECK(h.alpha == 3);
  CHECK(hair(R"(, "pheomelanin": 0.5)").eumelanin == 0);
  CHECK(*hair(R"(, "sigma_a": [0.1, 0.2, 3])").sigma_a == vec3{0.1f, 0.2f, 3});
  CHECK(*hair(R"(, "color": [0.1, 0.2, 1])").color == vec3{0.1f, 0.2f, 1});
  for (const char* bad : {R"("beta_m": 1.1)", R"("beta_n": -0.1)", R"("sigma_a": [1, -1, 1])",
                          R"("eta": 0.9)", R"("eumelanin": -1)", R"("color": [2, 0, 0])",
                          R"("pigment": "arnold")", R"("alpha": 90)"}) {
    std::string key(bad);
    key = key.substr(1, key.find('"', 1) - 1);
    CHECK(has(folder.error(material(R"("type": "hair", )" + std::string(bad))),
              "materials[0]." + key));
  }
  CHECK(has(folder.warning(material(R"("type": "hair", "color": [0,0,0], "eumelanin": 1)")),
            "materials[0].eumelanin"));
  CHECK(has(folder.warning(material(R"("type": "hair", "roughness": 1)")), "beta_m"));
  CHECK(has(folder.warning(material(R"("beta_m": 1)")), "materials[0].beta_m"));
}

TEST_CASE("scene json: hair beyond the paper's parameters") {
  scene_folder folder;
  auto hair = [&](const std::string& keys) {
    return folder.load(material(R"("type": "hair", )" + keys)).materials[0].hair;
  };
  auto h = hair(R"("p_max": 5, "coat": 0.25, "random_color": 0.5, "random_roughness": 0.125,
      "random": 0.75, "strand_uv": true, "lobes": {"R": {"strength": 0.5, "beta_m": 0.1},
      "TRT": {"strength": [1, 0.5, 0], "beta_n": 0.75}})");
  CHECK(h.p_max == 5);
  CHECK(h.coat == 0.25f);
  CHECK(h.random_color == 0.5f);
  CHECK(h.random_roughness == 0.125f);
  CHECK(h.random == 0.75f);
  CHECK(h.strand_uv);
  CHECK(h.strength[0] == vec3{0.5f});
  CHECK(h.strength[1] == vec3{1});
  CHECK(h.strength[2] == vec3{1, 0.5f, 0});
  CHECK(h.roughness[0] == vec2{0.1f, -1});
  CHECK(h.roughness[1] == vec2{-1, -1});
  CHECK(h.roughness[2] == vec2{-1, 0.75f});
  auto m = hair_on_strand(h);
  CHECK(m.parameters.p_max == 5);
  CHECK(m.parameters.coat == 0.25f);
  CHECK(m.parameters.strength[2] == vec3{1, 0.5f, 0});
  CHECK(m.parameters.beta_m == doctest::Approx(0.3f * 1.0625f));
  CHECK(m.parameters.roughness[0].x == doctest::Approx(0.1f * 1.0625f));
  CHECK(m.parameters.roughness[0].y == -1);
  CHECK(m.sigma_a.x == doctest::Approx(1.3f * 0.419f * 1.25f));

  CHECK(*hair(R"("reflectance": [0.5, 0.25, 0.125])").color == vec3{0.5f, 0.25f, 0.125f});
  auto pbrt = folder.load(material(R"("type": "pbrt_hair", "reflectance": [0.5, 0.25, 0.125])"));
  CHECK(pbrt.materials[0].type == material_type::hair);
  CHECK(*pbrt.materials[0].hair.color == vec3{0.5f, 0.25f, 0.125f});

  auto error = [&](const std::string& keys) {
    return folder.error(material(R"("type": "hair", )" + keys));
  };
  CHECK(has(error(R"("p_max": 0)"), "materials[0].p_max: is 0; it must be from 1 to 6"));
  CHECK(has(error(R"("coat": 2)"), "materials[0].coat"));
  CHECK(has(error(R"("random_color": -1)"), "materials[0].random_color"));
  CHECK(has(error(R"("random": 2)"), "materials[0].random"));
  CHECK(has(error(R"("lobes": [1])"), "materials[0].lobes: is an array of 1"));
  CHECK(has(error(R"("lobes": {"TT": 1})"), "materials[0].lobes.TT"));
  CHECK(has(error(R"("lobes": {"TT": {"strength": "x"}})"),
            "materials[0].lobes.TT.strength: must be a number or an array of 3 numbers"));
  CHECK(has(error(R"("lobes": {"TT": {"strength": -1}})"), "at least 0"));
  CHECK(has(error(R"("lobes": {"TT": {"beta_m": 2}})"), "materials[0].lobes.TT.beta_m"));
  auto warning = [&](const std::string& keys) {
    return folder.warning(material(R"("type": "hair", )" + keys));
  };
  CHECK(has(warning(R"("lobes": {"T": {}})"), "materials[0].lobes.T: unknown key"));
  CHECK(has(warning(R"("lobes": {"R": {"beta": 1}})"), "materials[0].lobes.R.beta: unknown key"));
  CHECK(has(warning(R"("lobes": {"R": {"strength": 2}})"), "more light leaves than arrives"));
  CHECK(has(warning(R"("sigma_a": [1,1,1], "reflectance": [0,0,0])"), "materials[0].reflectance"));
  CHECK(has(warning(R"("color": [0,0,0], "pigment": "cycles")"), "materials[0].pigment"));
  CHECK(has(folder.warning(material(R"("lobes": {})")), "only materials of type \"hair\""));
  CHECK(has(error(R"("roughness_tex": 0)"), "materials[0].roughness_tex"));
  auto textured = folder.load(R"({"textures": [{"uri": "a.png"}, {"uri": "b.exr"}], "materials":
      [{"type": "hair", "roughness_tex": 0, "sigma_a_tex": 1}]})");
  CHECK(textured.materials[0].roughness_tex == 0);
  CHECK(textured.materials[0].sigma_a_tex == 1);
}

TEST_CASE("scene json: Cycles' principled hair") {
  scene_folder folder;
  using hair::hair_parametrization;
  auto load = [&](const std::string& keys) {
    auto m = folder.load(material(R"("type": "principled_hair")" + keys)).materials[0];
    CHECK(m.type == material_type::hair);
    REQUIRE(m.hair.principled);
    return m.hair;
  };
  hair::principled_hair<float> defaults;
  auto h = load("");
  CHECK(h.principled->parametrization == hair_parametrization::color);
  CHECK(h.principled->color == defaults.color);
  CHECK(!color_varies(h));
  h = load(R"(, "melanin": 0.5, "melanin_redness": 0.25, "tint": [1, 0.5, 0.25], "roughness": 0.2,
      "radial_roughness": 0.4, "coat": 0.1, "ior": 1.45, "offset": 3, "random_color": 0.2,
      "random_roughness": 0.3, "model": "CHIANG")");
  const auto& p = *h.principled;
  CHECK(p.parametrization == hair_parametrization::melanin);
  CHECK(p.melanin == 0.5f);
  CHECK(p.melanin_redness == 0.25f);
  CHECK(p.tint == vec3{1, 0.5f, 0.25f});
  CHECK(p.roughness == 0.2f);
  CHECK(p.radial_roughness == 0.4f);
  CHECK(p.coat == 0.1f);
  CHECK(p.ior == 1.45f);
  CHECK(p.offset == 3);
  CHECK(p.random_color == 0.2f);
  CHECK(p.random_roughness == 0.3f);
  CHECK(color_varies(h));
  CHECK(roughness_varies(h));
  // The strand's number and a texture's factors go into Cycles' own formulas.
  auto q = p;
  q.random = 0.875f;
  q.roughness *= 0.5f;
  q.radial_roughness *= 0.25f;
  auto expected = hair::convert(q), got = hair_on_strand(h, 0.875f, {0.5f, 0.25f});
  CHECK(got.sigma_a == expected.sigma_a);
  CHECK(got.parameters.beta_m == expected.parameters.beta_m);
  CHECK(got.parameters.beta_n == expected.parameters.beta_n);
  CHECK(got.parameters.roughness == expected.parameters.roughness);
  CHECK(got.parameters.alpha == -3);
  h = load(R"(, "random_roughness": 1, "random": 0.25)");
  CHECK(!roughness_varies(h));
  CHECK(hair_on_strand(h, 0.9f).parameters.beta_m == doctest::Approx(0.15f));
  CHECK(load(R"(, "absorption_coefficient": [1, 2, 3])").principled->parametrization ==
        hair_parametrization::absorption);
  CHECK(load(R"(, "parametrization": "MELANIN")").principled->parametrization ==
        hair_parametrization::melanin);
  CHECK(load(R"(, "parametrization": "Absorption Coefficient")").principled->parametrization ==
        hair_parametrization::absorption);

  auto error = [&](const std::string& keys) {
    return folder.error(material(R"("type": "principled_hair", )" + keys));
  };
  for (const char* bad : {R"("melanin": 1.5)", R"("tint": [1, 2, 0])", R"("roughness": -1)",
                          R"("offset": 91)", R"("ior": 0.5)", R"("model": "HUANG")",
                          R"("parametrization": "colour")", R"("random_roughness": 2)"}) {
    std::string key(bad);
    key = key.substr(1, key.find('"', 1) - 1);
    CHECK(has(error(bad), "materials[0]." + key));
  }
  auto warning = [&](const std::string& keys) {
    return folder.warning(material(R"("type": "principled_hair", )" + keys));
  };
  CHECK(has(warning(R"("color": [0.5, 0.5, 0.5], "melanin": 0.5)"),
            "materials[0].melanin: has no effect, since \"color\" is given"));
  CHECK(has(warning(R"("parametrization": "COLOR", "tint": [1, 1, 1])"), "materials[0].tint"));
  CHECK(has(warning(R"("random_color": 0.5)"), "has no effect without melanin"));
  CHECK(has(warning(R"("beta_m": 0.5)"), "materials[0].beta_m: unknown key"));
  CHECK(has(warning(R"("melanine": 0.5)"), "did you mean 'melanin'?"));
}

TEST_CASE("scene json: MaterialX' hair") {
  scene_folder folder;
  auto load = [&](const std::string& keys) {
    auto m = folder.load(material(R"("type": "chiang_hair_bsdf")" + keys)).materials[0];
    CHECK(m.type == material_type::hair);
    return m.hair;
  };
  auto same = [](const hair_data& h, const hair::chiang_hair<float>& from) {
    auto got = hair_on_strand(h), expected = hair::convert(from);
    CHECK(got.sigma_a == expected.sigma_a);
    CHECK(got.parameters.roughness == expected.parameters.roughness);
    CHECK(got.parameters.strength == expected.parameters.strength);
    CHECK(got.parameters.alpha == expected.parameters.alpha);
    CHECK(got.parameters.eta == expected.parameters.eta);
  };
  hair::chiang_hair<float> from;
  same(load(""), from);
  auto pairs = hair::chiang_hair_roughness(0.3f, 0.2f, 0.5f, 1.5f);
  from.roughness_R = pairs[0], from.roughness_TT = {0.25f, 0.5f}, from.roughness_TRT = pairs[2];
  from.tint_TT = {1, 0.5f, 0.25f}, from.tint_R = vec3{0.5f};
  from.cuticle_angle = 0.51f, from.ior = 1.4f;
  from.absorption_coefficient =
      hair::chiang_hair_absorption_from_color<float>({0.5f, 0.25f, 0}, 0.4f);
  same(load(R"(, "longitudinal": 0.3, "scale_TRT": 1.5, "roughness_TT": [0.25, 0.5],
      "tint_TT": [1, 0.5, 0.25], "tint_R": 0.5, "cuticle_angle": 0.51, "ior": 1.4,
      "color": [0.5, 0.25, 0], "azimuthal_roughness": 0.4)"),
       from);
  from = {};
  from.absorption_coefficient =
      hair::deon_hair_absorption_from_melanin<float>(0.5f, 0.25f, {0.5f, 0.25f, 0.125f});
  same(load(R"(, "melanin_concentration": 0.5, "melanin_redness": 0.25,
      "eumelanin_color": [0.5, 0.25, 0.125])"),
       from);

  auto error = [&](const std::string& keys) {
    return folder.error(material(R"("type": "chiang_hair_bsdf", )" + keys));
  };
  for (const char* bad :
       {R"("tint_R": [1, -1, 0])", R"("roughness_R": [1, 2])", R"("roughness_TT": [1, 0.5, 0])",
        R"("cuticle_angle": 2)", R"("eumelanin_color": [0, 1, 1])", R"("scale_TT": -1)"}) {
    std::string key(bad);
    key = key.substr(1, key.find('"', 1) - 1);
    CHECK(has(error(bad), "materials[0]." + key));
  }
  auto warning = [&](const std::string& keys) {
    return folder.warning(material(R"("type": "chiang_hair_bsdf", )" + keys));
  };
  CHECK(has(warning(R"("absorption_coefficient": [1, 1, 1], "melanin_redness": 1)"),
            "materials[0].melanin_redness: has no effect, since \"absorption_coefficient\""));
  CHECK(has(warning(R"("azimuthal_roughness": 1)"), "materials[0].azimuthal_roughness"));
  CHECK(has(warning(R"("roughness_R": 0.5, "roughness_TT": 0.5, "roughness_TRT": 0.5,
      "azimuthal": 1)"),
            "materials[0].azimuthal: has no effect"));
  CHECK(has(warning(R"("tint_r": 1)"), "did you mean 'tint_R'?"));
}

TEST_CASE("scene json: roughness of points in PLY files") {
  scene_folder folder;
  folder.write("shapes/rough.ply",
               "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
               "property float z\nproperty float beta_n\nproperty float beta_m\nelement line 1\n"
               "property list uchar int vertex_indices\nend_header\n"
               "0 0 0 0.5 2\n0 1 0 0.25 1\n0 2 0 -1 0.5\n3 0 1 2\n");
  warning_list warnings;
  auto shape = load_shape(folder.path / "shapes/rough.ply", warnings);
  REQUIRE(shape.roughness.size() == 3);
  CHECK(shape.roughness[0] == vec2{2, 0.5f});
  CHECK(shape.roughness[1] == vec2{1, 0.25f});
  CHECK(shape.roughness[2] == vec2{1, 1});
  REQUIRE(warnings.size() == 1);
  CHECK(has(warnings[0], "which became 1"));
  warnings.clear();
  save_shape(folder.path / "copy.ply", shape, warnings);
  CHECK(load_shape(folder.path / "copy.ply", warnings).roughness == shape.roughness);
  CHECK(warnings.empty());
  save_shape(folder.path / "copy.hair", shape, warnings);
  CHECK(has(warnings.at(0), "roughness"));
  auto scene = folder.load(R"({"shapes": [{"uri": "copy.ply", "basis": "bspline"}],
      "materials": [{"type": "hair"}], "instances": [{"shape": 0, "material": 0}]})");
  REQUIRE(scene.shapes[0].roughness.size() == 5);
  CHECK(scene.shapes[0].roughness[0] == vec2{2, 0.5f});
}

TEST_CASE("scene json: strands with a basis, radii and a profile") {
  scene_folder folder;
  auto load = [&](const std::string& keys) {
    return folder.load(R"({"shapes": [{"uri": "shapes/lines.ply")" + keys +
                       R"(}], "materials": [{"type": "hair"}],
      "instances": [{"shape": 0, "material": 0}]})");
  };
  auto shape = load("").shapes[0];
  REQUIRE(strand_count(shape) == 1);
  CHECK(shape.basis == curve_basis::linear);
  CHECK(shape.radius == std::vector<float>(4, 0.001f));

  shape = load(R"(, "basis": "bspline", "radius": [0.3, 0], "profile": "round")").shapes[0];
  CHECK(shape.basis == curve_basis::bspline);
  CHECK(shape.profile == curve_profile::round);
  REQUIRE(shape.positions.size() == 6);
  CHECK(shape.strands == std::vector<uint32_t>{0, 6});
  // The curve begins and ends where the strand does.
  auto p = shape.positions;
  CHECK(glm::length((p[0] + 4.0f * p[1] + p[2]) / 6.0f - vec3{0, 0, 0}) < 1e-6f);
  CHECK(glm::length((p[3] + 4.0f * p[4] + p[5]) / 6.0f - vec3{0, 4, 0}) < 1e-6f);
  for (std::size_t i = 0; i < 6; i++)
    CHECK(shape.radius[i] == doctest::Approx(std::vector<float>{0.3f, 0.3f, 0.2f, 0.1f, 0, 0}[i]));

  shape = load(R"(, "basis": "bezier", "radius": 0.5)").shapes[0];
  CHECK(shape.positions.size() == 4);
  CHECK(shape.basis == curve_basis::bezier);
  CHECK(shape.radius == std::vector<float>(4, 0.5f));
  CHECK(load(R"(, "basis": "catmull_rom")").shapes[0].positions.size() == 6);

  auto bounds = scene_bounds(load(R"(, "basis": "bspline", "radius": 0)"));
  CHECK(glm::length(bounds[0]) < 1e-6f);
  CHECK(glm::length(bounds[1] - vec3{0, 4, 0}) < 1e-5f);

  std::string lines =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement line 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n0 1 0\n0 2 0\n3 0 1 2\n";
  folder.write("shapes/lines.ply", lines);
  CHECK(has(folder.error(
                R"({"shapes": [{"uri": "shapes/lines.ply", "basis": "bezier"}], "materials": [{}],
      "instances": [{"shape": 0, "material": 0}]})"),
            "shapes[0].basis: strand 0 has 3 points"));
  CHECK(load(R"(, "basis": "bspline")").shapes[0].positions.size() == 5);
  std::string quad =
      R"({"shapes": [{"uri": "shapes/quad.ply", "basis": "bspline"}], "materials": [{}],
      "instances": [{"shape": 0, "material": 0}]})";
  CHECK(has(folder.warning(quad), "shapes[0].basis: the file holds no strands"));
  CHECK(has(folder.error(R"({"shapes": [{"radius": [1, 2, 3]}]})"), "a number or an array of 2"));
  CHECK(has(folder.error(R"({"shapes": [{"radius": -1}]})"), "shapes[0].radius"));
}

TEST_CASE("scene json: grooms grow on meshes that come later in the file") {
  scene_folder folder;
  auto scene = folder.load(groom(R"(, "points": 12, "length": [0.1, 0.2], "radius": [0.01, 0.001],
      "curl": {"radius": 0.01, "turns": 2}, "clump": {"amount": 0.5, "size": 0.2}, "gravity": 0.2,
      "noise": 0.01, "frizz": 0.01, "taper": 2, "lift": 1, "comb": [1, 0, 0], "part": [1, 0, 0, 0.5],
      "volume": 0.01, "region": {"min": [0, 0, -1], "max": [0.5, 1, 1], "fade": 0},
      "density_axis": [0, 0, 1, 0.5], "seed": 7)"));
  const auto& hair = scene.shapes.at(0);
  CHECK(hair.name == "hair");
  CHECK(strand_count(hair) == 50);
  CHECK(hair.basis == curve_basis::bspline);
  CHECK(hair.positions.size() == hair.radius.size());
  for (std::size_t s = 0; s < strand_count(hair); s++) {
    auto i = hair.strands[s];
    vec3 root = (hair.positions[i] + 4.0f * hair.positions[i + 1] + hair.positions[i + 2]) / 6.0f;
    CHECK(std::abs(root.z) < 1e-3f);
    CHECK(root.x <= 0.501f);
  }
  CHECK(scene.shapes.at(1).positions.empty());  // shown by no instance
  CHECK(folder.load(groom(R"(, "length": 0.2)")).shapes[0].strands.size() == 51);

  CHECK(has(folder.error(groom(R"(, "strands": 0)")), "shapes[0].groom.strands"));
  CHECK(has(folder.error(groom(R"(, "points": 3)")), "shapes[0].groom.points"));
  CHECK(has(folder.error(groom(R"(, "strands": 1000000000, "points": 4096)")),
            "shapes[0].groom.strands"));
  CHECK(has(folder.error(groom(R"(, "length": [2, 1])")), "shapes[0].groom.length"));
  CHECK(has(folder.error(groom(R"(, "length": 0)")), "shapes[0].groom.length"));
  CHECK(has(folder.error(groom(R"(, "clump": 2)")), "shapes[0].groom.clump"));
  CHECK(has(folder.error(groom(R"(, "curl": {"radius": 1, "turns": 50})")),
            "shapes[0].groom.curl.turns"));
  CHECK(has(folder.error(groom(R"(, "curl": 3)")), "shapes[0].groom.curl"));
  CHECK(has(folder.error(groom(R"(, "seed": -1)")), "shapes[0].groom.seed"));
  CHECK(has(folder.error(groom(R"(, "region": {"min": [1,1,1], "max": [0,0,0]})")),
            "shapes[0].groom.region.max"));
  CHECK(has(folder.error(groom(R"(, "region": {"min": [5, 5, 5]})")), "shapes[0].groom: "));
  CHECK(has(folder.warning(groom(R"(, "curl": {"turn": 1})")),
            "shapes[0].groom.curl.turn: unknown key, ignored; did you mean 'turns'?"));
  std::string tail = R"(, "materials": [{}], "instances": [{"shape": 0, "material": 0}]})";
  CHECK(has(folder.error(R"({"shapes": [{"groom": {"on": 0}}])" + tail),
            "shapes[0].groom.on: is the groom itself"));
  CHECK(
      has(folder.error(R"({"shapes": [{"groom": {}}])" + tail), "shapes[0].groom.on: is missing"));
  CHECK(
      has(folder.error(R"({"shapes": [{"groom": {"on": 1}}, {"uri": "shapes/lines.ply"}])" + tail),
          "has no faces"));
}

TEST_CASE("scene json: subdivs load their mesh for a shape that is shown") {
  scene_folder folder;
  auto scene = folder.load(R"({"shapes": [{"name": "a", "uri": "shapes/absent.ply"}, {"name": "b"},
      {"name": "hair", "groom": {"on": "a", "strands": 10}}],
    "subdivs": [{"uri": "shapes/quad.ply", "shape": 0, "subdivisions": 3, "catmullclark": false, "smooth": false},
                {"uri": "shapes/absent.obj", "shape": "b"}],
    "materials": [{}], "instances": [{"shape": 0, "material": 0}, {"shape": "hair", "material": 0}]})");
  REQUIRE(scene.subdivs.size() == 2);
  CHECK(scene.subdivs[0].quadspos.size() == 1);
  CHECK(scene.subdivs[0].subdivisions == 3);
  CHECK(!scene.subdivs[0].catmullclark);
  CHECK(!scene.subdivs[0].smooth);
  CHECK(scene.subdivs[1].quadspos.empty());
  CHECK(strand_count(scene.shapes[2]) == 10);
  auto bounds = scene_bounds(scene);
  CHECK(bounds[1].x >= 1);
}

TEST_CASE("scene json: hair on faces becomes matte, strands take any material") {
  scene_folder folder;
  warning_list warnings;
  auto scene = folder.load(R"({"shapes": [{"uri": "shapes/quad.ply"}, {"uri": "shapes/lines.ply"}],
    "materials": [{"type": "hair", "color": [0.1, 0.2, 0.3]}, {}],
    "instances": [{"shape": 0, "material": 0}, {"shape": 1, "material": 0}, {"shape": 0, "material": 0},
                  {"shape": 1, "material": 1}]})",
                           warnings);
  REQUIRE(warnings.size() == 1);
  CHECK(has(warnings[0], "instances[0].material"));
  REQUIRE(scene.materials.size() == 3);
  CHECK(scene.materials[2].type == material_type::matte);
  CHECK(scene.materials[2].color == vec3{0.1f, 0.2f, 0.3f});
  CHECK(scene.instances[0].material == 2);
  CHECK(scene.instances[1].material == 0);
  CHECK(scene.instances[2].material == 2);
  CHECK(scene.instances[3].material == 1);
}
