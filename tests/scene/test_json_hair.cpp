#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "json_folder.h"
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
  CHECK(
      has(folder.error(R"({"solids": [{"name": "s"}], "shapes": [{"groom": {"on": "s"}}])" + tail),
          "is a solid"));
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
