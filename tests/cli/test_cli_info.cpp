// wisp info, wisp convert, and what there is with and without the render component.

#include <doctest/doctest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "run_command.h"

TEST_CASE("cli: info tells what is there and what will be built") {
  folder f;
  auto scene = simple_scene(f);
  auto o = run({"info", scene});
  CHECK(o.status == 0);
  for (auto word : {"square", "grey: matte", "main, top"})
    CHECK(o.out.find(word) != std::string::npos);
  for (auto word : {"to render it", "leaves out", "no curve segments in the scene"})
    CHECK((o.out.find(word) != std::string::npos) == has_render);
  auto info = nlohmann::json::parse(run({"info", scene, "--json"}).out);
  CHECK(info["instances"] == 1);
  CHECK(info["parts"].empty() != has_render);
  CHECK(run({"info", f / "none.json"}).status == 1);
}

TEST_CASE("cli: info tells the bounds of a shape's file without the lamp that it is seen by") {
  folder f;
  simple_scene(f);
  auto info = nlohmann::json::parse(run({"info", f / "square.obj", "--json"}).out);
  CHECK(info["bounds"] == nlohmann::json::parse("[[-1, 0, -1], [1, 0, 1]]"));
}

TEST_CASE("cli: info tells when its answer cannot be written") {
  if (!fs::exists("/dev/full")) return;
  folder f;
  auto scene = simple_scene(f);
  folder logs;
  for (const char* json : {"--json", "--quiet"}) {
    CHECK(finish(start({"info", scene, json}, "/dev/full", logs.path / "err")) == 1);
    CHECK(read_file(logs.path / "err").find("wisp: error: ") == 0);
  }
}

TEST_CASE("cli: convert keeps hair and meshes") {
  folder f;
  f.write(
      "hair.ply",
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float "
      "z\n"
      "property float radius\nelement line 3\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0 0.1\n0 1 0 0.1\n0 2 0 0.1\n5 0 0 0.1\n5 1 0 0.1\n2 0 1\n2 1 2\n2 3 4\n");
  std::string from = f / "hair.ply";
  for (auto name : {"a.hair", "a.pbrt", "b.ply"}) {
    auto o = run({"convert", from, f / name});
    CAPTURE(o.err);
    CHECK(o.status == 0);
    CHECK(o.out.find(name) != std::string::npos);
    auto info = nlohmann::json::parse(run({"info", f / name, "--json", "--quiet"}).out);
    bool found = false;
    for (const auto& s : info["shapes"])
      found = found || (s.contains("strands") && s["strands"] == 2);
    CHECK(found);
  }
  simple_scene(f);
  CHECK(run({"convert", f / "square.obj", f / "square.stl"}).status == 0);
  check_fault(f, {"convert", f / "square.obj", f / "square.hair"}, {"square.hair"});
  check_fault(f, {"convert", from, f / "hair.stl"}, {"hair.stl"});
  check_fault(f, {"convert", f / "gone.ply", f / "x.ply"}, {"gone.ply"});
  CHECK(run({"convert", from, f / "a.doc"}).status == 2);
}

TEST_CASE("cli: a command that does not exist is named") {
  auto o = run({"paint", "scene.json"});
  CHECK(o.status == 2);
  for (auto word : {"'paint'", "solve", "info", "convert", "stress"})
    CHECK(o.err.find(word) != std::string::npos);
}

TEST_CASE("cli: help and version tell which components are in") {
  const auto help = run({"--help"}).out, version = run({"--version"}).out;
  CHECK((help.find("  render") != std::string::npos) == has_render);
  CHECK(help.find("  solve") != std::string::npos);
  CHECK(version.rfind("wisp 0.", 0) == 0);
  CHECK(version.find("\ncomponents: core, hair, geometry, pde, scene") != std::string::npos);
  CHECK((version.find("scene, render\n") != std::string::npos) == has_render);
  CHECK((version.find("; without render\n") != std::string::npos) != has_render);
  const auto solve = run({"solve", "--help"}).out, convert = run({"convert", "--help"}).out;
  CHECK((solve.find(".png") != std::string::npos) == has_render);
  CHECK(solve.find(".vti") != std::string::npos);
  CHECK((convert.find(".glb") != std::string::npos) == has_render);
}

TEST_CASE("cli: what needs the render component is told of in one sentence" *
          doctest::skip(has_render)) {
  const std::string sentence =
      "needs the render component; this wisp is built without it (configure with "
      "-DWISP_BUILD_RENDER=ON to have it)";
  folder f;
  const auto scene = f.write("scene.json", R"({
    "textures": [{"name": "wood", "uri": "wood.png"}],
    "shapes": [{"name": "t", "uri": "t.obj"}],
    "solids": [{"name": "s", "sdf": {"sphere": {"radius": 1}}}],
    "problems": [{"name": "p", "domain": "s", "boundary": "x"},
                 {"name": "painted", "domain": "t", "boundary": {"texture": "wood"}},
                 {"name": "plate", "domain": "t", "equation": "biharmonic", "boundary": 0,
                  "boundary_laplacian": {"texture": 0}}],
    "sections": [{"name": "cut", "problem": "p", "resolution": 8}]})");
  f.write("t.obj",
          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\n"
          "f 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 1/1 4/1 3/1\nf 2/1 3/1 4/1\n");
  const auto points = f.write("p.csv", "x,y,z\n0.1,0.1,0.1\n");
  const auto files = f.files();
  const std::vector<std::pair<std::vector<std::string>, std::string>> uses = {
      {{"render", scene, "-o", f / "a.png"}, "solve, info, convert, stress"},
      {{"render"}, "'render'"},
      {{"solve", scene, "-o", f / "a.csv", "-o", f / "a.png"}, "a.png"},
      {{"solve", scene, "-o", f / "A.EXR"}, ".csv and .vti"}};
  for (const auto& [args, words] : uses) {
    auto o = run(args);
    CAPTURE(o.err);
    CHECK(o.status == 2);
    CHECK(o.err.find(sentence) != std::string::npos);
    CHECK(o.err.find(words) != std::string::npos);
    CHECK(std::count(o.err.begin(), o.err.end(), '\n') == 1);
  }
  CHECK(f.files() == files);
  check_fault(f, {"solve", scene, "--problem", "painted", "--points", points, "-o", f / "u.csv"},
              {"scene.json: problems[1].boundary.texture: ", "'wood'", sentence});
  check_fault(f, {"solve", scene, "--problem", "plate", "--points", points, "-o", f / "u.csv"},
              {"scene.json: problems[2].boundary_laplacian.texture: ", "'wood'", sentence});
  const auto gltf = f.write("a.glTF", R"({"asset": {"version": "2.0"}})");
  check_fault(f, {"info", gltf}, {"a.glTF", sentence});
  check_fault(f, {"convert", gltf, f / "a.ply"}, {"a.glTF", sentence});
  check_fault(f, {"info", f.write("a.txt", "")}, {"'.txt'", "not known"});
  check_fault(f, {"info", f / "absent.ply"}, {"absent.ply", "not found"});
  check_fault(f, {"info", f.path.string()}, {"is a folder"});
}
