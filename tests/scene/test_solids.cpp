#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "json_folder.h"
#include "wisp/core/rng.h"
#include "wisp/scene/solid.h"

using namespace wisp;
using namespace json_test;

namespace {

const std::string tail = R"(, "materials": [{}], "instances": [{"solid": 0, "material": 0}]})";

std::string with_sdf(const std::string& sdf, const std::string& more = "") {
  return R"({"solids": [{"name": "s", "sdf": )" + sdf + more + "}]" + tail;
}

// The octahedron |x| + |y| + |z| <= 1.
void write_octahedron(const scene_folder& folder, bool closed = true) {
  folder.write("shapes/octahedron.obj",
               std::string("v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\n"
                           "f 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\n") +
                   (closed ? "f 1 4 6\n" : ""));
}

}  // namespace

TEST_CASE("scene solids: every node of the format means what geometry says") {
  scene_folder folder;
  const dvec3 c = {0.1, 0.2, 0.3}, a = {-1, 0, 0.5}, b = {1, 0.5, 0};
  const sdf ball = sdf_sphere(c, 0.5), cube = sdf_box(c, {1, 2, 3});
  const std::vector<sdf> both = {ball, cube};
  const std::string center = R"("center": [0.1, 0.2, 0.3])",
                    ends = R"("a": [-1, 0, 0.5], "b": [1, 0.5, 0])";
  const std::string s = R"({"sphere": {)" + center + R"(, "radius": 0.5}})";
  const std::string x = R"({"box": {)" + center + R"(, "half": [1, 2, 3]}})";
  const std::string list = "[" + s + ", " + x + "]";
  const glm::dmat4x3 frame{0, 2, 0, -2, 0, 0, 0, 0, 2, 1, 2, 3};
  const std::vector<std::pair<std::string, sdf>> cases = {
      {s, ball},
      {x, cube},
      {R"({"rounded_box": {)" + center + R"(, "half": [1, 2, 3], "radius": 0.25}})",
       sdf_rounded_box(c, {1, 2, 3}, 0.25)},
      {R"({"torus": {)" + center + R"(, "normal": [1, 1, 0], "major": 1, "minor": 0.25}})",
       sdf_torus(c, {1, 1, 0}, 1, 0.25)},
      {R"({"torus": {"major": 1, "minor": 0.25}})", sdf_torus({0, 0, 0}, {0, 1, 0}, 1, 0.25)},
      {R"({"capsule": {)" + ends + R"(, "radius": 0.25}})", sdf_capsule(a, b, 0.25)},
      {R"({"cylinder": {)" + ends + R"(, "radius": 0.25}})", sdf_cylinder(a, b, 0.25)},
      {R"({"cone": {)" + ends + R"(, "radius_a": 0.25, "radius_b": 0}})", sdf_cone(a, b, 0.25, 0)},
      {R"({"plane": {"point": [0.1, 0.2, 0.3], "normal": [1, 2, 3]}})", sdf_plane(c, {1, 2, 3})},
      {R"({"ellipsoid": {)" + center + R"(, "radii": [1, 2, 3]}})", sdf_ellipsoid(c, {1, 2, 3})},
      {R"({"union": )" + list + "}", sdf_union(both)},
      {R"({"intersection": )" + list + "}", sdf_intersection(both)},
      {R"({"difference": )" + list + "}", sdf_difference(both)},
      {R"({"smooth_union": )" + list + R"(, "blend": 0.25})", sdf_smooth_union(both, 0.25)},
      {R"({"smooth_intersection": )" + list + R"(, "blend": 0.25})",
       sdf_smooth_intersection(both, 0.25)},
      {R"({"smooth_difference": )" + list + R"(, "blend": 0.25})",
       sdf_smooth_difference(both, 0.25)},
      {R"({"transform": {"frame": [0,2,0, -2,0,0, 0,0,2, 1,2,3], "of": )" + x + "}}",
       sdf_transform(frame, cube)},
      {R"({"offset": {"by": -0.125, "of": )" + x + "}}", sdf_offset(cube, -0.125)},
      {R"({"complement": {"of": )" + x + "}}", sdf_complement(cube)},
  };
  for (const auto& [text, expected] : cases) {
    CAPTURE(text);
    warning_list warnings;
    const scene_data scene = folder.load(with_sdf(text));
    REQUIRE(scene.solids.size() == 1);
    const sdf solid = make_sdf(scene, scene.solids[0], 1, warnings);
    rng_state rng = make_rng(1);
    for (int i = 0; i < 200; ++i) {
      const double px = 4 * rand1d(rng) - 2, py = 4 * rand1d(rng) - 2, pz = 4 * rand1d(rng) - 2;
      REQUIRE(signed_distance(solid, {px, py, pz}) == signed_distance(expected, {px, py, pz}));
    }
    const dbox3 bounds = solid_bounds(scene, scene.solids[0]);
    CHECK(bounds.min == properties(expected).bounds.min);
  }
}

TEST_CASE("scene solids: meshes are leaves, and only those that are needed are read") {
  scene_folder folder;
  write_octahedron(folder);
  const std::string shapes =
      R"("shapes": [{"name": "absent", "uri": "shapes/absent.ply"}, {"name": "o", "uri": "shapes/octahedron.obj"}],)";
  warning_list warnings;
  const scene_data scene = folder.load(
      "{" + shapes +
      R"("solids": [{"name": "unused", "sdf": {"mesh": "absent"}}, {"name": "s", "sdf": {"difference":
        [{"mesh": "o"}, {"sphere": {"radius": 0.25}}]}}],
        "materials": [{}], "instances": [{"solid": "s", "material": 0}, {"solid": 1, "material": 0}]})");
  REQUIRE(scene.shapes.size() == 3);  // the two instances share what they show
  CHECK(scene.shapes[2].solid == 1);
  CHECK(scene.instances[0].shape == 2);
  CHECK(scene.instances[1].shape == 2);
  CHECK(scene.shapes[0].positions.empty());
  solid_parts parts;
  const sdf solid = make_sdf(scene, scene.solids[1], 1, warnings, &parts);
  CHECK(warnings.empty());
  CHECK(parts.meshes == 1);
  CHECK(parts.open_meshes == 0);
  CHECK(signed_distance(solid, {0, 0, 0}) == doctest::Approx(0.25));
  CHECK(signed_distance(solid, {0.3, 0, 0}) == doctest::Approx(-0.05));
  CHECK(signed_distance(solid, {2, 0, 0}) == doctest::Approx(1));
  CHECK(signed_distance(solid, {1, 1, 1}) == doctest::Approx(2 / std::sqrt(3.0)));
  const dbox3 bounds = solid_bounds(scene, scene.solids[1]);
  CHECK(bounds.max == dvec3{1, 1, 1});
  const auto box = scene_bounds(scene);
  CHECK(box[0] == vec3{-1, -1, -1});

  write_octahedron(folder, false);
  const scene_data open = folder.load("{" + shapes + R"("solids": [{"sdf": {"mesh": 1}}])" + tail);
  make_sdf(open, open.solids[0], 1, warnings, &parts);
  REQUIRE(warnings.size() == 1);
  CHECK(has(warnings[0], "open"));
  CHECK(parts.open_meshes == 1);
}

TEST_CASE("scene solids: the mesh of a solid lies on it, with its normals") {
  scene_folder folder;
  const scene_data scene = folder.load(with_sdf(
      R"({"difference": [{"box": {"half": [1, 0.5, 0.75]}}, {"sphere": {"center": [1, 0.5, 0.75], "radius": 0.5}}]})",
      R"(, "resolution": 64)"));
  warning_list warnings;
  const sdf solid = make_sdf(scene, scene.solids[0], 1, warnings);
  const shape_data mesh = tesselate_solid(scene.solids[0], solid, 1);
  REQUIRE(mesh.triangles.size() > 10000);
  REQUIRE(mesh.normals.size() == mesh.positions.size());
  double volume = 0, area = 0, flat = 0;
  for (const ivec3& t : mesh.triangles) {
    dvec3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = mesh.positions[static_cast<std::size_t>(t[k])];
    const dvec3 n = glm::cross(p[1] - p[0], p[2] - p[0]);
    volume += glm::dot(p[0], glm::cross(p[1], p[2])) / 6;
    area += glm::length(n) / 2;
    const double l = glm::length(n);
    if (l == 0) continue;
    for (int k = 0; k < 3; ++k) {
      flat += l / 6 * glm::dot(n / l, dvec3(mesh.normals[static_cast<std::size_t>(t[k])]));
    }
  }
  const double expected = 3 - 4.0 / 3 * 3.14159265358979 * 0.125 / 8;
  CHECK(volume == doctest::Approx(expected).epsilon(1e-3));
  CHECK(flat > 0.998 * area);  // normals are those of the faces that they belong to
  for (const vec3& p : mesh.positions) {
    REQUIRE(std::abs(signed_distance(solid, dvec3(p))) < 4e-3);
  }
}

TEST_CASE("scene solids: hair grows on solids") {
  scene_folder folder;
  const scene_data scene = folder.load(
      R"({"solids": [{"name": "ball", "sdf": {"sphere": {"radius": 1}}, "resolution": 48}],
          "shapes": [{"name": "fur", "groom": {"on": "ball", "strands": 300, "length": 0.2}}],
          "materials": [{"type": "hair"}], "instances": [{"shape": "fur", "material": 0}]})");
  REQUIRE(strand_count(scene.shapes[0]) == 300);
  // B-splines: the curve begins near the second control point
  for (std::size_t k = 0; k < 300; ++k) {
    const vec3 root = scene.shapes[0].positions[scene.shapes[0].strands[k] + 1];
    REQUIRE(glm::length(root) == doctest::Approx(1).epsilon(0.03));
  }
}

TEST_CASE("scene solids: mistakes are told with their place") {
  scene_folder folder;
  write_octahedron(folder);
  const std::map<std::string, std::string> mistakes = {
      {R"({"sphere": {"radius": 0}})", "solids[0].sdf.sphere.radius"},
      {R"({"sphere": {}})", "solids[0].sdf.sphere.radius: is missing"},
      {R"({"spere": {"radius": 1}})", "did you mean 'sphere'?"},
      {R"({})", "is an empty object"},
      {R"([1])", "solids[0].sdf"},
      {R"({"sphere": {"radius": 1}, "box": {"half": [1,1,1]}})", "is given as well as"},
      {R"({"union": []})", "solids[0].sdf.union: must be an array of one or more solids"},
      {R"({"union": [{"sphere": {"radius": 1}}, {"box": {"half": [1, 1]}}]})",
       "solids[0].sdf.union[1].box.half"},
      {R"({"smooth_union": [{"sphere": {"radius": 1}}]})", "solids[0].sdf.blend: is missing"},
      {R"({"torus": {"normal": [0,0,0], "major": 1, "minor": 1}})", "is no direction"},
      {R"({"cylinder": {"a": [0,0,0], "b": [0,0,0], "radius": 1}})", "needs a length"},
      {R"({"transform": {"frame": [1,0,0,2,0,0,0,0,1,0,0,0], "of": {"sphere": {"radius": 1}}}})",
       "must not lie in a plane"},
      {R"({"offset": {"by": 1}})", "solids[0].sdf.offset.of: is missing"},
      {R"({"mesh": "nothing"})", "there is nothing called"},
      {R"({"rounded_box": {"half": [1,1,1], "radius": 2}})", "smallest half size"},
  };
  for (const auto& [text, expected] : mistakes) {
    CAPTURE(text);
    std::string error = folder.error(with_sdf(text));
    if (error == "no error") {
      // what only geometry knows is said when the solid is made
      warning_list warnings;
      const scene_data scene = folder.load(with_sdf(text));
      try {
        make_sdf(scene, scene.solids[0], 1, warnings);
      } catch (const std::invalid_argument& e) {
        error = e.what();
      }
    }
    CAPTURE(error);
    CHECK(has(error, expected));
  }
  CHECK(has(folder.error(R"({"solids": [{"name": "s"}]})"), "solids[0].sdf: is missing"));
  CHECK(has(
      folder.error(
          R"({"shapes": [{"uri": "shapes/quad.ply"}], "solids": [{"sdf": {"sphere": {"radius": 1}}}],
      "materials": [{}], "instances": [{"shape": 0, "solid": 0, "material": 0}]})"),
      "is given as well as"));
  CHECK(has(
      folder.error(
          R"({"shapes": [{"name": "g", "groom": {"on": "g"}}], "solids": [{"sdf": {"mesh": 0}}])" +
          tail),
      "has no file"));
  warning_list warnings;
  for (const char* text : {R"({"plane": {"normal": [0, 1, 0]}})",
                           R"({"complement": {"of": {"sphere": {"radius": 1}}}})"}) {
    const scene_data scene = folder.load(with_sdf(text));
    const sdf solid = make_sdf(scene, scene.solids[0], 1, warnings);
    CHECK_THROWS_AS(tesselate_solid(scene.solids[0], solid, 1), std::invalid_argument);
  }
}
