// The command as a user meets it: exit statuses, messages, whole files or none.

#include <doctest/doctest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "run_command.h"
#include "wisp/render/image.h"

TEST_CASE("cli: help, version and wrong use") {
  CHECK(run({"--help"}).status == 0);
  CHECK(run({"--version"}).out.find("wisp 0.") == 0);
  for (auto command : {"render", "info", "convert"}) {
    auto o = run({command, "--help"});
    CHECK(o.status == 0);
    CHECK(o.out.find("Example:") != std::string::npos);
  }
  folder f;
  auto scene = simple_scene(f);
  for (const auto& args : std::vector<std::vector<std::string>>{
           {},
           {"paint", scene},
           {"render"},
           {"render", scene},
           {"render", scene, "-o", f / "a.gif"},
           {"render", scene, "-o", f / "a"},
           quick(scene, f / "a.png") + std::vector<std::string>{"--samples", "0"},
           quick(scene, f / "a.png") + std::vector<std::string>{"--resolution", "0"},
           quick(scene, f / "a.png") + std::vector<std::string>{"--resolution", "10x"},
           quick(scene, f / "a.png") + std::vector<std::string>{"--resolution", "99999999"},
           quick(scene, f / "a.png") + std::vector<std::string>{"--camera", "left"},
           quick(scene, f / "a.png") + std::vector<std::string>{"--aovs", "smell"},
           quick(scene, f / "a.png") + std::vector<std::string>{"--threads", "-1"},
           quick(scene, f / "a.png") + std::vector<std::string>{"--time", "soon"},
           {"convert", scene}}) {
    auto o = run(args);
    CAPTURE(o.err);
    CHECK(o.status == 2);
    CHECK_FALSE(o.err.empty());
  }
  CHECK_FALSE(fs::exists(f.path / "a.png"));
}

TEST_CASE("cli: a render writes every output, with names and metadata, and a report") {
  folder f;
  auto scene = simple_scene(f);
  auto o = run({"render", scene, "-o", f / "a.exr", "-o", f / "a.png", "-o", f / "a.hdr", "-o",
                f / "a.jpg", "--resolution", "24", "--samples", "4", "--aovs",
                "albedo,normal,tangent,depth,error", "--report", f / "r.json"});
  CAPTURE(o.err);
  CHECK(o.status == 0);
  CHECK(o.err.empty());
  for (auto name : {"a.exr", "a.png", "a.hdr", "a.jpg"})
    CHECK(o.out.find(name) != std::string::npos);
  auto image = wisp::load_image(f / "a.exr");
  CHECK(image.width == 24);
  CHECK(image.height == 16);
  for (auto name : {"R", "G", "B", "A", "albedo.R", "normal.X", "tangent.Z", "depth.Z", "error.V"})
    CHECK(std::find(image.channels.begin(), image.channels.end(), name) != image.channels.end());
  std::string exr = read_file(f / "a.exr");
  for (auto key : {"wisp:version", "wisp:command", "wisp:samples", "wisp:seconds"})
    CHECK(exr.find(key) != std::string::npos);
  auto report = nlohmann::json::parse(read_file(f / "r.json"));
  CHECK(report["samples"] == 4);
  CHECK(report["seconds"].contains("render"));
  CHECK(report["peak_memory_bytes"].get<double>() > 1e6);
  int left_out = 0;
  for (const auto& part : report["parts"]) {
    CHECK_FALSE(part["why"].get<std::string>().empty());
    if (!part["built"]) left_out++;
    if (part["name"] == "curve rays") CHECK_FALSE(part["built"].get<bool>());
  }
  CHECK(left_out >= 5);
}

TEST_CASE("cli: the image library is left out where no texture is read and .exr is written") {
  folder f;
  auto scene = simple_scene(f);
  // What a run reports of the image library, and whether the loader of the C
  // library, which writes a log where asked to, has loaded OpenImageIO.
  auto built_and_loaded = [&](const std::string& from, const std::string& out) {
    folder logs;
    setenv("LD_DEBUG", "files", 1);
    setenv("LD_DEBUG_OUTPUT", (logs / "log").c_str(), 1);
    auto args = quick(from, f / out) + std::vector<std::string>{"--report", f / "r.json"};
    int status = finish(start(args, logs.path / "out", logs.path / "err"));
    unsetenv("LD_DEBUG");
    unsetenv("LD_DEBUG_OUTPUT");
    CHECK(status == 0);
    std::string log;
    for (const auto& entry : fs::directory_iterator(logs.path)) log += read_file(entry.path());
    REQUIRE(log.find("libembree") != std::string::npos);
    bool loaded = log.find("libOpenImageIO") != std::string::npos;
    auto report = nlohmann::json::parse(read_file(f / "r.json"));
    for (const auto& part : report["parts"])
      if (part["name"] == "image library") return std::pair{part["built"].get<bool>(), loaded};
    FAIL("the report does not tell of the image library");
    return std::pair{false, false};
  };
  CHECK(built_and_loaded(scene, "a.exr") == std::pair{false, false});
  CHECK(built_and_loaded(scene, "a.png").second);
  auto textured = f.write("textured.json", R"({"textures": [{"uri": "a.exr"}],
    "shapes": [{"uri": "square.obj"}], "materials": [{"color_tex": 0}],
    "instances": [{"shape": 0, "material": 0}], "environments": [{"emission": [1, 1, 1]}]})");
  CHECK(built_and_loaded(textured, "b.exr") == std::pair{true, true});
}

TEST_CASE("cli: --quiet is silent, cameras are found by name, budgets stop") {
  folder f;
  auto scene = simple_scene(f);
  auto o = run(quick(scene, f / "a.exr") + std::vector<std::string>{"--quiet", "--camera", "top"});
  CHECK(o.status == 0);
  CHECK(o.out.empty());
  CHECK(o.err.empty());
  o = run({"render", scene, "-o", f / "b.exr", "--resolution", "16", "--time", "0.2", "--report",
           f / "r.json"});
  CHECK(o.status == 0);
  auto report = nlohmann::json::parse(read_file(f / "r.json"));
  CHECK(report["samples"].get<int>() > 1);
  CHECK(report["seconds"]["render"].get<double>() < 30);
  o = run({"render", scene, "-o", f / "b.exr", "--resolution", "16", "--error", "0.05", "--report",
           f / "r.json"});
  CHECK(nlohmann::json::parse(read_file(f / "r.json"))["error"].get<double>() <= 0.05);
}

TEST_CASE("cli: the same image at any number of threads, another with another seed") {
  folder f;
  auto scene = simple_scene(f);
  auto pixels = [&](const std::vector<std::string>& more) {
    REQUIRE(run(quick(scene, f / "a.exr") + more).status == 0);
    return wisp::load_image(f / "a.exr").pixels;
  };
  auto one = pixels({"--threads", "1"});
  CHECK(one == pixels({"--threads", "2"}));
  CHECK(one == pixels({"--threads", "7"}));
  CHECK(one != pixels({"--seed", "9"}));
}

TEST_CASE("cli: bad scenes give one message with file, place and reason") {
  folder f;
  auto scene = simple_scene(f);
  auto bad = [&](const std::string& text, const std::vector<std::string>& words) {
    auto path = f.write("bad.json", text);
    auto all = words;
    all.push_back("bad.json");
    check_fault(f, quick(path, f / "a.exr"), all);
  };
  check_fault(f, quick(f / "none.json", f / "a.exr"), {"none.json", "not found"});
  check_fault(f, quick(f.path.string(), f / "a.exr"), {});
  check_fault(f, quick(f.write("scene.xyz", "hello"), f / "a.exr"), {"scene.xyz", ".json"});
  bad("", {});
  bad("this is not JSON", {"line 1"});
  bad("{\"asset\": {\"version\": \"4.2\"},\n \"cameras\": [}", {"line 2"});
  bad(std::string("\x7f\x45\x4c\x46\0\1\2", 7), {});
  bad(std::string(100000, '['), {});
  bad(R"({"shapes": 5})", {"shapes"});
  bad(R"({"cameras": [{"frame": [1, 2, 3]}]})", {"cameras[0].frame", "12"});
  bad(R"({"materials": [{"color": "red"}]})", {"materials[0].color"});
  bad(R"({"materials": [{"type": "jelly"}]})", {"materials[0].type", "matte"});
  bad(R"({"shapes": [{"uri": "square.obj"}], "materials": [{}], "instances": [{"shape": 7, "material": 0}]})",
      {"instances[0].shape", "7"});
  bad(R"({"shapes": [{"uri": "gone.ply"}], "materials": [{}], "instances": [{"shape": 0, "material": 0}]})",
      {"gone.ply"});
  check_fault(
      f,
      quick(
          f.write(
              "bad.json",
              R"({"textures": [{"uri": "gone.png"}], "environments": [{"emission": [1, 1, 1], "emission_tex": 0}]})"),
          f / "a.exr"),
      {"gone.png", "not found"});
}

TEST_CASE("cli: an empty scene is an error, unknown keys a warning") {
  folder f;
  check_fault(f, quick(f.write("empty.json", "{}"), f / "a.exr"), {"nothing to render"});
  auto scene = simple_scene(f, R"(, "colour": 5)");
  auto o = run(quick(scene, f / "a.exr"));
  CHECK(o.status == 0);
  CHECK(o.err.find("colour") != std::string::npos);
}

TEST_CASE("cli: outputs that cannot be written are refused before rendering") {
  folder f;
  auto scene = simple_scene(f);
  check_fault(f, quick(scene, f / "no/such/folder/a.exr"), {"no/such/folder"});
  fs::create_directory(f.path / "folder.exr");
  check_fault(f, quick(scene, f / "folder.exr"), {"folder.exr"});
  check_fault(f, quick(scene, f / "a.exr") + std::vector<std::string>{"--report", f / "no/r.json"},
              {"no/r.json"});
}

TEST_CASE("cli: Ctrl-C saves what is there and exits with 130") {
  folder f;
  auto scene = simple_scene(f);
  folder logs;
  pid_t pid =
      start({"render", scene, "-o", f / "a.exr", "--resolution", "64", "--samples", "10000000"},
            logs.path / "out", logs.path / "err");
  std::this_thread::sleep_for(std::chrono::seconds(3));
  kill(pid, SIGINT);
  CHECK(finish(pid) == 130);
  CHECK(read_file(logs.path / "out").find("saved what there is") != std::string::npos);
  auto image = wisp::load_image(f / "a.exr");
  CHECK(image.width == 64);
  CHECK(image.pixels[std::size_t(4 * (64 * 20 + 32))] > 0.1f);
  for (const auto& entry : fs::directory_iterator(f.path))
    CHECK(entry.path().filename().string().find("tmp") == std::string::npos);
}

TEST_CASE("cli: convert joins the instances of a glTF file") {
  folder f;
  // A triangle in the plane z = 0 and a strand through its corners.
  std::string head = R"({"asset": {"version": "2.0"}, "scene": 0, "nodes": [)";
  std::string tail = R"(],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]},
               {"primitives": [{"attributes": {"POSITION": 0}, "mode": 3}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                   "min": [0, 0, 0], "max": [1, 1, 0]}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,)"
                     "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"
                     R"("}]})";
  f.write("mirror.gltf", head + R"({"mesh": 0, "scale": [-1, 1, 1]}], "scenes": [{"nodes": [0]}])" +
                             tail.substr(1));
  CHECK(run({"convert", f / "mirror.gltf", f / "mirror.stl"}).status == 0);
  float normal[3] = {};
  auto stl = read_file(f / "mirror.stl");
  REQUIRE(stl.size() == 84 + 50);
  std::memcpy(normal, stl.data() + 84, sizeof normal);
  CHECK(normal[2] == 1);  // what is outside stays outside

  // Faces before strands, and a strand's radius grows with it.
  f.write("both.gltf", head + R"({"mesh": 0}, {"mesh": 1, "scale": [8, 8, 8]}],
    "scenes": [{"nodes": [0, 1]}])" +
                           tail.substr(1));
  auto o = run({"convert", f / "both.gltf", f / "both.ply"});
  CAPTURE(o.err);
  CHECK(o.status == 0);
  auto info = nlohmann::json::parse(run({"info", f / "both.ply", "--json"}).out);
  CHECK(info["shapes"][0]["strands"] == 1);
  CHECK(info["shapes"][1]["triangles"] == 1);
  double radius = -info["bounds"][0][2].get<double>();
  CHECK(radius == doctest::Approx(8 * std::sqrt(2.0) / 2000).epsilon(0.01));
}
