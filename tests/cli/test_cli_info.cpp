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
