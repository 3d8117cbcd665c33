#pragma once

// A folder with a scene and small meshes, for the tests of JSON scenes.

#include <doctest/doctest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "wisp/scene/io.h"

namespace json_test {

using namespace wisp;
namespace fs = std::filesystem;

// A folder with a scene and small meshes, gone at the end of the test.
struct scene_folder {
  fs::path path;
  scene_folder() {
    static std::atomic<int> count = 0;
    path = fs::temp_directory_path() /
           ("wisp_json_" + std::to_string(std::random_device{}()) + "_" + std::to_string(count++));
    fs::create_directories(path / "shapes");
    write("shapes/quad.ply",
          "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
          "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
          "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
    write("shapes/lines.ply",
          "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
          "property float z\nelement line 1\nproperty list uchar int vertex_indices\nend_header\n"
          "0 0 0\n0 1 0\n0 2 0\n0 4 0\n4 0 1 2 3\n");
  }
  ~scene_folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  scene_folder(const scene_folder&) = delete;
  scene_folder& operator=(const scene_folder&) = delete;

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name, std::ios::binary) << text;
  }
  scene_data load(const std::string& text, warning_list& warnings) const {
    write("scene.json", text);
    return load_json_scene(path / "scene.json", warnings);
  }
  scene_data load(const std::string& text) const {
    warning_list warnings;
    auto scene = load(text, warnings);
    for (const auto& w : warnings) FAIL_CHECK("unexpected warning: ", w);
    return scene;
  }
  // The place and the reason of the error that loading gives.
  std::string error(const std::string& text) const {
    warning_list warnings;
    try {
      load(text, warnings);
    } catch (const file_error& e) {
      CHECK(e.file.ends_with("scene.json"));
      return e.place + ": " + e.reason;
    }
    return "no error";
  }
  std::string warning(const std::string& text) const {
    warning_list warnings;
    load(text, warnings);
    return warnings.size() == 1 ? warnings[0] : std::to_string(warnings.size()) + " warnings";
  }
};

inline bool has(const std::string& text, const std::string& part) {
  bool found = text.find(part) != std::string::npos;
  if (!found) MESSAGE("'", text, "' lacks '", part, "'");
  return found;
}

inline std::string material(const std::string& keys) {
  return R"({"materials": [{)" + keys + "}]}";
}
inline std::string groom(const std::string& keys) {
  return R"({"shapes": [{"name": "hair", "groom": {"on": "skin", "strands": 50)" + keys +
         R"(}}, {"name": "skin", "uri": "shapes/quad.ply"}],
    "materials": [{"type": "hair"}], "instances": [{"shape": "hair", "material": 0}]})";
}

}  // namespace json_test
