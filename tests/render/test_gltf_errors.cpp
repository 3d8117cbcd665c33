// Files that are wrong, and load_scene.

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>

#include "gltf_builder.h"
#include "wisp/render/gltf.h"

using namespace wisp;
using namespace gltf_test;

TEST_CASE("gltf: cycles, shared children and nodes out of range are errors") {
  auto scene = [](const std::string& nodes) {
    return R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[)" + nodes + "]}";
  };
  CHECK(contains(error_of(scene(R"({"children":[1]},{"children":[0]})")), "reached twice"));
  CHECK(contains(error_of(scene(R"({"children":[0]})")), "reached twice"));
  CHECK(contains(error_of(scene(R"({"children":[1,2]},{"children":[2]},{})")), "reached twice"));
  CHECK(contains(error_of(scene(R"({"children":[7]})")), "does not exist"));
  CHECK(contains(error_of(scene(R"({"children":[-1]})")), "does not exist"));
  CHECK(contains(error_of(scene(R"({"mesh":3})")), "mesh 3 does not exist"));
  CHECK(contains(error_of(scene(R"({"camera":3})")), "does not exist"));
  CHECK(contains(error_of(R"({"asset":{"version":"2.0"},"scene":4,"scenes":[{}]})"),
                 "scene 4 does not exist"));
  // A long chain is fine.
  std::string chain;
  for (int i = 0; i < 20000; i++) chain += R"({"children":[)" + std::to_string(i + 1) + "]},";
  CHECK(error_of(scene(chain + "{}")).empty());
}

TEST_CASE("gltf: what is not supported is said once, or is an error when required") {
  builder b;
  int p = b.vec3s(square);
  auto prim = R"({"attributes":{"POSITION":)" + std::to_string(p) + R"(},"targets":[{"POSITION":)" +
              std::to_string(p) + "}]}";
  auto l = load_text(b.json(mesh_scene(prim + "," + prim,
                                       R"(,"animations":[{}],"skins":[{"joints":[0]}],
                        "extensionsUsed":["KHR_materials_sheen"])"),
                            true));
  CHECK(l.warnings.size() == 4);
  CHECK(has_warning(l, "animations"));
  CHECK(has_warning(l, "skins"));
  CHECK(has_warning(l, "morph"));
  CHECK(has_warning(l, "KHR_materials_sheen"));
  CHECK(l.scene.shapes.size() == 2);
  auto required = [&](const std::string& name) {
    return error_of(b.json(mesh_scene(prim, R"(,"extensionsRequired":[")" + name + "\"]"), true));
  };
  CHECK(contains(required("KHR_draco_mesh_compression"), "decompress"));
  CHECK(contains(required("EXT_meshopt_compression"), "decompress"));
  CHECK(contains(required("VENDOR_unknown"), "VENDOR_unknown"));
  CHECK(required("KHR_mesh_quantization").empty());
}

TEST_CASE("gltf: errors say what is wrong") {
  builder b;
  int p = b.vec3s(square);
  int i = b.shorts({0, 1, 9});
  auto attributes = R"({"attributes":{"POSITION":)" + std::to_string(p) + "}";
  auto with_index = attributes + R"(,"indices":)" + std::to_string(i) + "}";
  CHECK(contains(error_of(b.json(mesh_scene(with_index), true)), "index 9 is out of range"));
  CHECK(contains(error_of(b.json(mesh_scene(attributes + R"(,"indices":77})"), true)), "accessor"));
  auto big = b;
  big.accessor(0, 5126, 1000, "VEC3");
  CHECK(contains(error_of(big.json(mesh_scene(R"({"attributes":{"POSITION":2}})"), true)),
                 "do not fit"));
  auto huge = b;
  huge.accessor(0, 5126, 6148914691236517206u, "VEC3");
  CHECK(contains(error_of(huge.json(mesh_scene(R"({"attributes":{"POSITION":2}})"), true)),
                 "do not fit"));
  auto empty = b;
  empty.accessor(-1, 5126, 1ull << 40, "VEC3");
  CHECK(contains(error_of(empty.json(mesh_scene(R"({"attributes":{"POSITION":2}})"), true)),
                 "without a buffer view"));
  auto scalar = b;
  scalar.floats({1, 2, 3}, 1, "SCALAR");
  CHECK(contains(error_of(scalar.json(mesh_scene(R"({"attributes":{"POSITION":2}})"), true)),
                 "components"));
  CHECK(contains(error_of(R"({"asset":{"version":"1.0"}})"), "2.0"));
  CHECK(contains(error_of(R"({"scenes":[]})"), "asset"));
  CHECK(contains(error_of("{ \"asset\": "), "JSON"));
  CHECK(contains(error_of(""), "JSON"));
  CHECK(contains(error_of(std::string(100000, '[')), "nested"));
  CHECK(contains(error_of(R"({"asset":{"version":"2.0"},"extras":)" + std::string(5000, '[') +
                          std::string(5000, ']') + "}"),
                 "nested"));
  CHECK(contains(
      error_of(R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":"no.bin"}]})"),
      "file not found"));
  CHECK(contains(
      error_of(
          R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":40,"uri":"data:;base64,AAAA"}]})"),
      "only 3"));
  CHECK(contains(
      error_of(R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":1,"uri":"https://a/b"}]})"),
      "network"));
  auto glb = b.glb(mesh_scene(attributes + "}"));
  CHECK(error_of(glb, "a.glb").empty());
  CHECK(contains(error_of(glb.substr(0, glb.size() - 8), "a.glb"), "truncated"));
  warning_list warnings;
  CHECK_THROWS_AS(load_gltf_scene("/no/such/file.gltf", warnings), file_error);
}

TEST_CASE("gltf: vertices that are not finite") {
  builder b;
  auto broken = square;
  broken[4] = std::nanf("");
  int p = b.vec3s(broken);
  int i = b.shorts({0, 1, 2, 0, 2, 3});
  auto l = load_text(b.json(mesh_scene(R"({"attributes":{"POSITION":)" + std::to_string(p) +
                                       R"(},"indices":)" + std::to_string(i) + "}"),
                            true));
  CHECK(l.scene.shapes.at(0).triangles.size() == 1);
  CHECK(has_warning(l, "not finite"));
}

TEST_CASE("gltf: corrupt files load or throw file_error") {
  builder b;
  int p = b.vec3s(square);
  int t = b.floats({0, 0, 1, 0, 1, 1, 0, 1}, 2, "VEC2");
  int i = b.shorts({0, 1, 2, 0, 2, 3});
  int si = b.view(std::vector<uint8_t>{1, 2});
  int sv = b.view(std::vector<float>{5, 0, 0, 0, 7, 0});
  int sparse = b.accessor(0, 5126, 4, "VEC3",
                          R"(,"sparse":{"count":2,"indices":{"bufferView":)" + std::to_string(si) +
                              R"(,"componentType":5121},"values":{"bufferView":)" +
                              std::to_string(sv) + "}}");
  auto rest =
      mesh_scene(R"({"attributes":{"POSITION":)" + std::to_string(p) + R"(,"TEXCOORD_0":)" +
                     std::to_string(t) + R"(},"indices":)" + std::to_string(i) +
                     R"(,"material":0},{"attributes":{"POSITION":)" + std::to_string(sparse) +
                     R"(},"mode":1})",
                 R"(,"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
      "textures":[{"source":0}],"images":[{"bufferView":1}],"cameras":[
      {"type":"perspective","perspective":{"yfov":0.6,"znear":0.1}}],
      "extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{}}]}})");
  temporary_folder folder;
  auto attempt = [&](const std::string& bytes) {
    write_all(folder.path / "a.glb", bytes);
    warning_list warnings;
    try {
      load_gltf_scene(folder.path / "a.glb", warnings);
    } catch (const file_error&) {
      return false;
    }
    return true;
  };
  auto glb = b.glb(rest);
  REQUIRE(attempt(glb));
  for (std::size_t n = 0; n < glb.size(); n += 7) CHECK_FALSE(attempt(glb.substr(0, n)));
  std::mt19937 random(1);
  int survived = 0;
  for (int round = 0; round < 3000; round++) {
    auto bytes = glb;
    for (int k = 0; k < 1 + round % 3; k++) {
      auto& c = bytes[random() % bytes.size()];
      // digits to digits keep the JSON valid more often
      c = c >= '0' && c <= '9' && round % 2 ? static_cast<char>('0' + random() % 10)
                                            : static_cast<char>(random());
    }
    survived += attempt(bytes);
  }
  CHECK(survived > 0);
  CHECK(survived < 3000);
}

TEST_CASE("gltf: load_scene chooses by ending") {
  temporary_folder folder;
  warning_list warnings;
  auto error = [&](const fs::path& path) -> std::string {
    try {
      load_scene(path, warnings);
    } catch (const file_error& e) {
      return e.what();
    }
    return "";
  };
  CHECK(contains(error(folder.path / "no.gltf"), "file not found"));
  CHECK(contains(error(folder.path), "folder"));
  write_all(folder.path / "a.txt", "x");
  CHECK(contains(error(folder.path / "a.txt"), ".gltf"));

  builder b;
  int p = b.vec3s(square);
  write_all(folder.path / "a.GLB",
            b.glb(mesh_scene(R"({"attributes":{"POSITION":)" + std::to_string(p) + "}}")));
  auto scene = load_scene(folder.path / "a.GLB", warnings);
  CHECK(scene.cameras.size() == 1);
  CHECK(scene.environments.size() == 1);
  CHECK(warnings.size() == 2);

  write_all(folder.path / "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
            "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
            "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  scene = load_scene(folder.path / "a.ply", warnings);
  REQUIRE(scene.cameras.size() == 1);
  CHECK(scene.environments.size() == 1);
  REQUIRE(scene.instances.size() == 2);  // the shape and a lamp
  REQUIRE(scene.materials.size() == 2);
  CHECK(scene.materials[0].type == material_type::matte);
  CHECK(scene.materials[1].emission.x > 0);
  // The lamp shines at the shape.
  const auto& lamp = scene.instances[1].frame;
  CHECK(glm::dot(lamp[2], vec3{0.5f, 0.5f, 0} - lamp[3]) > 0);
}

TEST_CASE("gltf: a compressed file gets one clear error") {
  const char* data = std::getenv("WISP_TEST_DATA");
  if (!data) {
    MESSAGE("skipped: WISP_TEST_DATA is not set");
    return;
  }
  warning_list warnings;
  std::string message;
  try {
    load_gltf_scene(fs::path(data) / "hair/lee-perry-smith/LeePerrySmith.glb", warnings);
  } catch (const file_error& error) {
    message = error.what();
  }
  CHECK(contains(message, "KHR_draco_mesh_compression"));
  CHECK(contains(message, "decompress"));
}
