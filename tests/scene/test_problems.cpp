#include <doctest/doctest.h>

#include <map>
#include <string>
#include <utility>

#include "json_folder.h"

using namespace wisp;
using namespace json_test;

namespace {

const std::string ball = R"("solids": [{"name": "ball", "sdf": {"sphere": {"radius": 1}}}])";

std::string problem(const std::string& keys) {
  return "{" + ball + R"(, "problems": [{"name": "p", "domain": "ball", )" + keys + "}]}";
}
std::string poisson(const std::string& keys) {
  return problem(R"("equation": "poisson", "boundary": "x", )" + keys);
}
std::string section(const std::string& keys) {
  return "{" + ball + R"(, "problems": [{"name": "p", "domain": "ball", "boundary": "x"}],
    "sections": [{"name": "cut", )" +
         keys + "}]}";
}

// A tetrahedron with vertex colours and texture coordinates.
void write_tetrahedron(const scene_folder& folder, const std::string& name, bool plain = false) {
  const std::string more = plain ? ""
                                 : "property float red\nproperty float green\nproperty float blue\n"
                                   "property float u\nproperty float v\n";
  const auto vertex = [&](const std::string& p, const std::string& rest) {
    return p + (plain ? "" : " " + rest) + "\n";
  };
  folder.write("shapes/" + name,
               "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
               "property float z\n" +
                   more + "element face 4\nproperty list uchar int vertex_indices\nend_header\n" +
                   vertex("0 0 0", "1 0 0 0 0") + vertex("1 0 0", "0 1 0 1 0") +
                   vertex("0 1 0", "0 0 1 0 1") + vertex("0 0 1", "1 1 1 1 1") +
                   "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
}

}  // namespace

TEST_CASE("scene problems: every key is read") {
  scene_folder folder;
  scene_data scene =
      folder.load("{" + ball + R"(, "shapes": [{"name": "wire", "uri": "shapes/lines.ply"},
        {"name": "plate", "uri": "shapes/quad.ply"}],
      "problems": [{"name": "heat", "domain": "ball", "side": "exterior", "equation": "screened_poisson",
        "screening": 2.5, "boundary": ["x", "y", 1], "source": "exp(-x^2)*10", "exact": "",
        "point_sources": [{"position": [0, 0.5, 2]}, {"position": [0, 0, 3], "strength": [1, 2, 3]}],
        "curve_sources": [{"points": [[0, 0, 2], [0, 1, 2]], "strength": 4}, {"shape": "wire"}],
        "mesh_sources": [{"shape": "plate", "strength": -5}],
        "source_peaks": [{"center": [1, 2, 3], "radius": 0.25, "weight": 2}],
        "infinity": 0, "epsilon": 1e-5, "walks": 128, "max_steps": 300
},
       {"domain": 0, "boundary": "1"}]
})");
  REQUIRE(scene.problems.size() == 2);
  const problem_data& p = scene.problems[0];
  CHECK(p.name == "heat");
  CHECK(p.solid == 0);
  CHECK(p.shape == invalid_id);
  CHECK(p.exterior);
  CHECK(p.equation == problem_equation::screened_poisson);
  CHECK(p.screening == 2.5);
  CHECK(p.channels == 3);
  CHECK(p.boundary.formulas == std::vector<std::string>{"x", "y", "1"});
  CHECK(p.source.formulas == std::vector<std::string>{"exp(-x^2)*10"});
  CHECK_FALSE(is_given(p.exact));
  REQUIRE(p.point_sources.size() == 2);
  CHECK(p.point_sources[0].position == dvec3{0, 0.5, 2});
  CHECK(p.point_sources[0].strength == dvec4{1, 1, 1, 0});
  CHECK(p.point_sources[1].strength == dvec4{1, 2, 3, 0});
  REQUIRE(p.curve_sources.size() == 2);
  CHECK(p.curve_sources[0].points == std::vector<dvec3>{{0, 0, 2}, {0, 1, 2}});
  CHECK(p.curve_sources[0].strength == dvec4{4, 4, 4, 0});
  CHECK(p.curve_sources[1].shape == 0);
  REQUIRE(p.mesh_sources.size() == 1);
  CHECK(p.mesh_sources[0].shape == 1);
  CHECK(p.mesh_sources[0].strength == dvec4{-5, -5, -5, 0});
  REQUIRE(p.source_peaks.size() == 1);
  CHECK(p.source_peaks[0].center == dvec3{1, 2, 3});
  CHECK(p.source_peaks[0].radius == 0.25);
  CHECK(p.source_peaks[0].weight == 2);
  CHECK(p.epsilon == 1e-5);
  CHECK(p.walks == 128);
  CHECK(p.max_steps == 300);
  const problem_data& q = scene.problems[1];
  CHECK(q.equation == problem_equation::laplace);
  CHECK_FALSE(q.exterior);
  CHECK(q.channels == 1);
  CHECK(q.epsilon == 0);
  CHECK(q.walks == 64);
  CHECK(q.max_steps == 1024);

  scene = folder.load(problem(R"("side": "exterior", "boundary": "x", "infinity": [1, 2, 3])"));
  CHECK(scene.problems[0].channels == 3);
  CHECK(scene.problems[0].infinity == dvec4{1, 2, 3, 0});
  scene = folder.load(problem(R"("side": "exterior", "boundary": -0.5, "infinity": 7)"));
  CHECK(scene.problems[0].infinity == dvec4{7, 0, 0, 0});
  CHECK(scene.problems[0].boundary.formulas == std::vector<std::string>{"-0.5"});
  scene = folder.load(
      problem(R"("equation": "biharmonic", "boundary": ["x", "y"], "boundary_laplacian": 0)"));
  CHECK(scene.problems[0].channels == 2);
  CHECK(is_given(scene.problems[0].boundary_laplacian));
}

TEST_CASE("scene problems: sections and their instances") {
  scene_folder folder;
  scene_data scene = folder.load(section(
      R"("problem": "p", "origin": [1, 2, 3], "normal": [0, 1, 0], "up": [0, 0, 1], "size": [2, 3],
         "resolution": 100, "colormap": "coolwarm", "range": [-1, 2.5], "contours": 0, "lit": true},
        {"problem": 0, "size": 4)"));
  REQUIRE(scene.sections.size() == 2);
  const section_data& s = scene.sections[0];
  CHECK(s.name == "cut");
  CHECK(s.problem == 0);
  CHECK(s.origin == dvec3{1, 2, 3});
  CHECK(s.normal == dvec3{0, 1, 0});
  CHECK(s.up == dvec3{0, 0, 1});
  CHECK(s.size == dvec2{2, 3});
  CHECK(s.resolution == 100);
  CHECK(s.colormap == section_colors::coolwarm);
  REQUIRE(s.range);
  CHECK(*s.range == dvec2{-1, 2.5});
  CHECK(s.contours == 0);
  CHECK(s.lit);
  const section_data& t = scene.sections[1];
  CHECK(t.size == dvec2{4, 4});
  CHECK(t.normal == dvec3{0, 0, 1});
  CHECK(t.colormap == section_colors::viridis);
  CHECK_FALSE(t.range);
  CHECK(t.contours == 10);
  CHECK_FALSE(t.lit);

  const std::string shown = "{" + ball + R"(, "problems": [{"domain": "ball", "boundary": "x"}],
    "sections": [{"name": "cut", "problem": 0}], "shapes": [{"uri": "shapes/quad.ply"}], "materials": [{}],)";
  scene = folder.load(shown +
                      R"("instances": [{"section": "cut", "frame": [1,0,0, 0,1,0, 0,0,1, 5,0,0]},
    {"shape": 0, "material": 0}]})");
  REQUIRE(scene.instances.size() == 2);
  CHECK(scene.instances[0].section == 0);
  CHECK(scene.instances[0].shape == invalid_id);
  CHECK(scene.instances[1].section == invalid_id);
  CHECK(scene_bounds(scene)[1].x == 6);  // the solid of the problem
  CHECK(
      has(folder.error(shown + R"("instances": [{"section": "cut", "shape": 0, "material": 0}]})"),
          "instances[0].section: is given as well as"));
  CHECK(has(folder.error(shown + R"("instances": [{"section": "cat"}]})"), "did you mean 'cut'?"));

  const std::map<std::string, std::string> mistakes = {
      {R"("origin": [0, 0, 0])", "sections[0].problem: is missing"},
      {R"("problem": "q")", "nothing called 'q'"},
      {R"("problem": 0, "normal": [0, 0, 0])", "sections[0].normal: is [0, 0, 0]"},
      {R"("problem": 0, "up": [0, 0, 0])", "sections[0].up: is [0, 0, 0]"},
      {R"("problem": 0, "up": [0, 0, 2])", "along the normal"},
      {R"("problem": 0, "size": 0)", "sections[0].size"},
      {R"("problem": 0, "size": [1, -1])", "two positive numbers"},
      {R"("problem": 0, "resolution": 1)", "sections[0].resolution: is 1"},
      {R"("problem": 0, "colormap": "viridas")", "did you mean 'viridis'?"},
      {R"("problem": 0, "range": [1, 1])", "the smaller one first"},
      {R"("problem": 0, "range": 1)", "sections[0].range"},
      {R"("problem": 0, "contours": -1)", "sections[0].contours"},
  };
  for (const auto& [keys, expected] : mistakes) {
    CAPTURE(keys);
    CHECK(has(folder.error(section(keys)), expected));
  }
}

TEST_CASE("scene problems: mistakes are told with their place") {
  scene_folder folder;
  const std::string b = R"("boundary": "x", )";
  const std::map<std::string, std::string> mistakes = {
      {problem(R"("side": "interior")"), "problems[0].boundary: is missing"},
      {problem(R"("boundary": "")"), "problems[0].boundary: is missing"},
      {problem(R"("boundary": "sin(20*foo)*1")"),
       "problems[0].boundary: at character 8 of \"sin(20*foo)*1\""},
      {problem(R"("boundary": ["x", "y +"])"), "problems[0].boundary[1]: at character 4"},
      {problem(R"("boundary": [])"), "is an array of 0"},
      {problem(R"("boundary": [1, 2, 3, 4, 5])"), "is an array of 5"},
      {problem(R"("boundary": true)"), "must be a formula"},
      {problem(R"("boundary": [[1]])"), "problems[0].boundary[0]: must be a formula"},
      {problem(R"("boundary": "1/0")"), "is infinite"},
      {problem(R"("boundary": "sqrt(-1)*2")"), "is not a number"},
      {problem(R"("boundary": {})"), "problems[0].boundary: must be"},
      {problem(R"("boundary": {"vertex_colors": true})"), "must name the shape"},
      {problem(R"("boundary": {"vertex_colors": false})"), "must be true"},
      {problem(R"("boundary": {"texture": "wood"})"), "nothing called 'wood'"},
      {problem(b + R"("exact": ["x", "y"], "equation": "poisson", "source": ["1", "2", "3"])"),
       "problems[0].source: has 3 channels, but problems[0].exact has 2"},
      {problem(b + R"("exact": {"vertex_colors": true})"), "problems[0].exact: must be a formula"},
      {problem(b + R"("side": "outside")"), "problems[0].side"},
      {problem(b + R"("equation": "wave")"), "must be one of laplace, poisson"},
      {problem(b + R"("screening": 1)"), "problems[0].screening: belongs to"},
      {problem(b + R"("equation": "screened_poisson")"), "problems[0].screening: is missing"},
      {problem(b + R"("equation": "screened_poisson", "screening": -1)"),
       "problems[0].screening: is -1"},
      {problem(b + R"("equation": "biharmonic")"), "problems[0].boundary_laplacian: is missing"},
      {problem(b + R"("boundary_laplacian": "0")"), "belongs to the equation \"biharmonic\""},
      {problem(b + R"("equation": "biharmonic", "boundary_laplacian": "0", "side": "exterior")"),
       "problems[0].side"},
      {problem(b + R"("source": "1")"), "problems[0].source: is given, but the equation has no"},
      {problem(b + R"("point_sources": [{"position": [0,0,0]}])"), "problems[0].point_sources"},
      {problem(b + R"("walks": 0)"), "problems[0].walks: is 0"},
      {problem(b + R"("walks": 1.5)"), "problems[0].walks"},
      {problem(b + R"("epsilon": 0)"), "problems[0].epsilon: is 0"},
      {problem(b + R"("epsilon": -1)"), "problems[0].epsilon: is -1"},
      {problem(b + R"("max_steps": 0)"), "problems[0].max_steps"},
      {poisson(R"("point_sources": {})"), "must be an array"},
      {poisson(R"("point_sources": [{}])"), "problems[0].point_sources[0].position: is missing"},
      {poisson(R"("point_sources": [{"position": [0,0,0], "strength": "big"}])"),
       "problems[0].point_sources[0].strength"},
      {poisson(R"("curve_sources": [{"points": [[0,0,0]]}])"), "two or more points"},
      {poisson(R"("curve_sources": [{"points": [[0,0,0], [1,2]]}])"),
       "problems[0].curve_sources[0].points[1]"},
      {poisson(R"("curve_sources": [{"strength": 1}])"), "problems[0].curve_sources[0].points"},
      {poisson(R"("mesh_sources": [{}])"), "problems[0].mesh_sources[0].shape: is missing"},
      {poisson(R"("source_peaks": [{"center": [0,0,0], "radius": 0}])"),
       "problems[0].source_peaks[0].radius"},
      {problem(b + R"("side": "exterior", "equation": "screened_poisson", "screening": 1,
               "infinity": 1)"),
       "problems[0].infinity: must be 0"},
      {R"({"problems": [{"boundary": "x"}]})", "problems[0].domain: is missing"},
      {R"({"problems": [{"domain": "bull", "boundary": "x"}], )" + ball + "}",
       "did you mean 'ball'?"},
      {R"({"problems": [{"domain": 0, "boundary": "x"}]})", "the scene has no \"solids\""},
      {R"({"problems": [3]})", "problems[0]"},
  };
  for (const auto& [text, expected] : mistakes) {
    CAPTURE(text);
    CHECK(has(folder.error(text), expected));
  }
  CHECK(has(folder.warning(problem(b + R"("infinity": 1)")), "only exterior"));
  CHECK(has(folder.warning(problem(b + R"("wolks": 1)")), "did you mean 'walks'?"));
}

TEST_CASE("scene problems: only the shapes of the problem that is solved are read") {
  scene_folder folder;
  write_tetrahedron(folder, "t.ply");
  write_tetrahedron(folder, "plain.ply", true);
  const std::string text = R"({"shapes": [{"name": "t", "uri": "shapes/t.ply"},
      {"name": "absent", "uri": "shapes/absent.ply"}, {"name": "plain", "uri": "shapes/plain.ply"},
      {"name": "wire", "uri": "shapes/lines.ply"},
      {"name": "fur", "groom": {"on": "absent"}}],
    "textures": [{"name": "image", "uri": "absent.png"}], "materials": [{"type": "hair"}],
    "solids": [{"name": "carved", "sdf": {"difference": [{"mesh": "t"}, {"sphere": {"radius": 0.1}}]}},
               {"name": "two", "sdf": {"union": [{"mesh": "t"}, {"mesh": "plain"}]}},
               {"name": "broken", "sdf": {"mesh": "absent"}}],
    "problems": [
      {"name": "colors", "domain": "carved", "boundary": {"vertex_colors": true}},
      {"name": "direct", "domain": "plain", "boundary": {"texture": "image", "shape": "t"}},
      {"name": "wires", "domain": "plain", "boundary": "x", "equation": "poisson",
       "curve_sources": [{"shape": "wire"}], "mesh_sources": [{"shape": "t"}]},
      {"name": "broken", "domain": "broken", "boundary": "x"},
      {"name": "absent", "domain": "absent", "boundary": "x"},
      {"name": "lines", "domain": "wire", "boundary": "x"},
      {"name": "colorless", "domain": "plain", "boundary": {"vertex_colors": true}},
      {"name": "no uv", "domain": "plain", "boundary": {"texture": 0}},
      {"name": "no strands", "domain": "plain", "boundary": "x", "equation": "poisson",
       "curve_sources": [{"shape": "t"}]},
      {"name": "groom", "domain": "fur", "boundary": "x"}],
    "sections": [{"name": "cut", "problem": "direct"}],
    "instances": [{"shape": "fur", "material": 0}, {"section": "cut"}]})";
  folder.write("scene.json", text);
  const auto solve = [&](int index) {
    warning_list warnings;
    scene_load_options options;
    options.choose_problem = [&](const scene_data& scene) {
      CHECK(scene.problems.size() == 10);
      return index;
    };
    return load_json_scene(folder.path / "scene.json", warnings, options);
  };
  const auto loaded = [](const scene_data& scene) {
    std::string names;
    for (const auto& shape : scene.shapes)
      if (!shape.positions.empty()) names += shape.name + " ";
    return names;
  };
  const auto error = [&](int index) {
    try {
      solve(index);
    } catch (const file_error& e) {
      return e.place + ": " + e.reason;
    }
    return std::string("no error");
  };
  scene_data scene = solve(0);
  CHECK(loaded(scene) == "t ");
  CHECK(scene.problems[0].boundary.vertex_colors);
  CHECK(scene.problems[0].boundary.shape == 0);
  CHECK(scene.problems[0].channels == 3);
  CHECK(scene.instances.empty());
  scene = solve(1);
  CHECK(loaded(scene) == "t plain ");
  CHECK(scene.problems[1].shape == 2);
  CHECK(scene.problems[1].boundary.texture == 0);
  CHECK(loaded(solve(2)) == "t plain wire ");
  CHECK(has(error(3), "shapes[1].uri: there is no file"));
  CHECK(has(error(4), "shapes[1].uri: there is no file"));
  CHECK(has(error(5), "problems[5].domain: the shape 'wire' has no faces"));
  CHECK(has(error(6), "problems[6].boundary: the shape 'plain' has no vertex colours"));
  CHECK(has(error(7), "problems[7].boundary: the shape 'plain' has no texture coordinates"));
  CHECK(has(error(8), "problems[8].curve_sources[0].shape: the shape 't' has no strands"));
  CHECK(has(error(9), "problems[9].domain: the mesh 'fur' has no file"));
  CHECK(has(error(99), "there is no problem 99"));
  // to render: what instances show
  CHECK(has(folder.error(text), "absent.ply"));
  const std::string hair = R"({"shape": "fur", "material": 0}, )";
  std::string bare = text;
  bare.erase(bare.find(hair), hair.size());
  CHECK(loaded(folder.load(bare)) == "t plain ");
  // a domain of several meshes has no colours of its own
  CHECK(has(
      folder.error(
          R"({"shapes": [{"name": "t", "uri": "shapes/t.ply"}, {"name": "u", "uri": "shapes/t.ply"}],
    "solids": [{"name": "two", "sdf": {"union": [{"mesh": "t"}, {"mesh": "u"}]}}],
    "problems": [{"domain": "two", "boundary": {"vertex_colors": true}}]})"),
      "problems[0].boundary.vertex_colors: must name the shape"));
}
