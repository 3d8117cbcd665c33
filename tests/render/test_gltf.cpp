#include <doctest/doctest.h>

#include <cmath>

#include "gltf_builder.h"
#include "wisp/render/gltf.h"
#include "wisp/render/image.h"

using namespace wisp;
using namespace gltf_test;

TEST_CASE("gltf: triangles with indices and attributes") {
  builder b;
  int p = b.vec3s(square);
  int n = b.vec3s({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  int t = b.accessor(b.view(std::vector<uint16_t>{0, 0, 65535, 0, 65535, 65535, 0, 65535}), 5123, 4,
                     "VEC2", R"(,"normalized":true)");
  int c = b.accessor(
      b.view(std::vector<uint8_t>{255, 0, 51, 255, 255, 0, 51, 255, 255, 0, 51, 255, 0, 0, 0, 0}),
      5121, 4, "VEC4", R"(,"normalized":true)");
  int i = b.shorts({0, 1, 2, 0, 2, 3});
  auto prim = R"({"attributes":{"POSITION":)" + std::to_string(p) + R"(,"NORMAL":)" +
              std::to_string(n) + R"(,"TEXCOORD_0":)" + std::to_string(t) + R"(,"COLOR_0":)" +
              std::to_string(c) + R"(},"indices":)" + std::to_string(i) + "}";
  for (bool binary : {false, true}) {
    auto l = binary ? load_text(b.glb(mesh_scene(prim)), "scene.glb")
                    : load_text(b.json(mesh_scene(prim), true));
    REQUIRE(l.warnings.empty());
    REQUIRE(l.scene.shapes.size() == 1);
    REQUIRE(l.scene.instances.size() == 1);
    const auto& s = l.scene.shapes[0];
    CHECK(s.name == "m");
    REQUIRE(s.triangles.size() == 2);
    CHECK((s.triangles[1] == ivec3{0, 2, 3}));
    REQUIRE(s.positions.size() == 4);
    check_vec(s.positions[2], {1, 1, 0});
    check_vec(s.normals[3], {0, 0, 1});
    CHECK(s.texcoords[1].x == 1);
    CHECK(s.colors[0].z == doctest::Approx(0.2));
    // the default material of glTF
    REQUIRE(l.scene.materials.size() == 1);
    CHECK(l.scene.materials[0].type == material_type::gltfpbr);
    CHECK(l.scene.materials[0].metallic == 1);
  }
}

TEST_CASE("gltf: strips, fans, and no indices") {
  builder b;
  int p = b.vec3s({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0});
  auto prim = [&](int mode) {
    return R"({"attributes":{"POSITION":)" + std::to_string(p) + R"(},"mode":)" +
           std::to_string(mode) + "}";
  };
  auto strip = load_text(b.json(mesh_scene(prim(5)), true)).scene.shapes.at(0);
  REQUIRE(strip.triangles.size() == 3);
  for (const auto& t : strip.triangles) {  // all turn the same way
    auto at = [&](int i) { return strip.positions[static_cast<std::size_t>(i)]; };
    CHECK(glm::cross(at(t.y) - at(t.x), at(t.z) - at(t.x)).z > 0);
  }
  auto fan = load_text(b.json(mesh_scene(prim(6)), true)).scene.shapes.at(0);
  REQUIRE(fan.triangles.size() == 3);
  auto points = load_text(b.json(mesh_scene(prim(0)), true)).scene.shapes.at(0);
  CHECK(points.points.size() == 5);
  REQUIRE(points.radius.size() == 5);
  CHECK(points.radius[0] == doctest::Approx(std::sqrt(5.0) / 2000));
  CHECK(contains(error_of(b.json(mesh_scene(prim(9)), true)), "mode"));
}

TEST_CASE("gltf: interleaved, sparse and missing data") {
  builder b;
  // position and a colour of three floats in one view
  std::vector<float> mixed;
  for (std::size_t v = 0; v < 3; v++)
    mixed.insert(mixed.end(), {square[3 * v], square[3 * v + 1], square[3 * v + 2], 0.1f, 0.2f,
                               static_cast<float>(v)});
  int view = b.view(mixed, 24);
  int p = b.accessor(view, 5126, 3, "VEC3");
  int c = b.accessor(view, 5126, 3, "VEC3", R"(,"byteOffset":12)");
  int indices = b.view(std::vector<uint8_t>{1, 2});
  int values = b.view(std::vector<float>{5, 0, 0, 0, 7, 0});
  auto sparse = R"(,"sparse":{"count":2,"indices":{"bufferView":)" + std::to_string(indices) +
                R"(,"componentType":5121},"values":{"bufferView":)" + std::to_string(values) + "}}";
  int zeros = b.accessor(-1, 5126, 3, "VEC3", sparse);
  auto l = load_text(
      b.json(mesh_scene(R"({"attributes":{"POSITION":)" + std::to_string(p) + R"(,"COLOR_0":)" +
                        std::to_string(c) + R"(}},{"attributes":{"POSITION":)" +
                        std::to_string(zeros) + "}}"),
             true));
  REQUIRE(l.scene.shapes.size() == 2);
  CHECK(l.scene.shapes[0].name == "m.0");
  check_vec(l.scene.shapes[0].positions[1], {1, 0, 0});
  CHECK(l.scene.shapes[0].colors[2] == vec4{0.1f, 0.2f, 2, 1});
  check_vec(l.scene.shapes[1].positions[0], {0, 0, 0});
  check_vec(l.scene.shapes[1].positions[1], {5, 0, 0});
  check_vec(l.scene.shapes[1].positions[2], {0, 7, 0});
}

TEST_CASE("gltf: vertices that no element uses are dropped") {
  builder b;
  int p = b.vec3s(square);
  int i = b.shorts({3, 1, 2});
  auto s = load_text(b.json(mesh_scene(R"({"attributes":{"POSITION":)" + std::to_string(p) +
                                       R"(},"indices":)" + std::to_string(i) + "}"),
                            true))
               .scene.shapes.at(0);
  REQUIRE(s.positions.size() == 3);
  check_vec(s.positions[static_cast<std::size_t>(s.triangles[0].x)], {0, 1, 0});
}

TEST_CASE("gltf: lines become strands") {
  builder b;
  int p = b.vec3s({0, 0, 0, 0, 1, 0, 0, 2, 0, 5, 0, 0, 5, 1, 0, 5, 2, 0});
  int r = b.floats({0.1f, 0.2f, 0.3f, 0, 0.5f, 0.6f}, 1, "SCALAR");
  auto attributes = R"({"attributes":{"POSITION":)" + std::to_string(p) + R"(,"_RADIUS":)" +
                    std::to_string(r) + R"(},"mode":)";
  SUBCASE("segments, out of order") {
    int i = b.shorts({4, 5, 0, 1, 3, 4, 1, 2});
    auto l = load_text(
        b.json(mesh_scene(attributes + R"(1,"indices":)" + std::to_string(i) + "}"), true));
    const auto& s = l.scene.shapes.at(0);
    REQUIRE((s.strands == std::vector<uint32_t>{0, 3, 6}));
    CHECK(s.basis == curve_basis::linear);
    // from the end that segments point away from
    check_vec(s.positions[0], {0, 0, 0});
    check_vec(s.positions[2], {0, 2, 0});
    check_vec(s.positions[3], {5, 0, 0});
    CHECK(s.radius[1] == doctest::Approx(0.2));
    CHECK(s.radius[3] > 0);  // zero makes no sense: the default
    CHECK(l.scene.materials.at(0).type == material_type::hair);
  }
  SUBCASE("a strip") {
    auto s = load_text(b.json(mesh_scene(attributes + "3}"), true)).scene.shapes.at(0);
    CHECK((s.strands == std::vector<uint32_t>{0, 6}));
  }
  SUBCASE("a loop") {
    auto s = load_text(b.json(mesh_scene(attributes + "2}"), true)).scene.shapes.at(0);
    CHECK((s.strands == std::vector<uint32_t>{0, 7}));
    check_vec(s.positions[6], {0, 0, 0});
  }
  SUBCASE("a loop of segments, and a fork") {
    int loop = b.shorts({0, 1, 1, 2, 2, 0});
    int fork = b.shorts({0, 1, 1, 2, 1, 3});
    auto l =
        load_text(b.json(mesh_scene(attributes + R"(1,"indices":)" + std::to_string(loop) + "}," +
                                    R"({"attributes":{"POSITION":)" + std::to_string(p) +
                                    R"(},"mode":1,"indices":)" + std::to_string(fork) + "}"),
                         true));
    REQUIRE(l.scene.shapes.size() == 1);  // one material: one shape
    CHECK((l.scene.shapes[0].strands == std::vector<uint32_t>{0, 4, 6, 8, 10}));
    REQUIRE(l.scene.shapes[0].radius.size() == 10);
    CHECK(l.scene.shapes[0].radius[9] > 0);
  }
  SUBCASE("strands without length are left out") {
    int i = b.shorts({0, 0, 1, 1});
    auto l = load_text(
        b.json(mesh_scene(attributes + R"(1,"indices":)" + std::to_string(i) + "}"), true));
    CHECK(l.scene.shapes.empty());
  }
}

TEST_CASE("gltf: node transforms and instancing") {
  builder b;
  int p = b.vec3s(square);
  auto l = load_text(b.json(
      R"("scene":1,"scenes":[{"nodes":[3]},{"nodes":[0]}],"nodes":[
      {"children":[1,2],"translation":[1,2,3],"rotation":[0,0,0.70710678,0.70710678]},
      {"mesh":0,"name":"a","scale":[2,3,4],"translation":[1,0,0]},
      {"mesh":0,"matrix":[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,5,0,1]},
      {"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":)" +
          std::to_string(p) + "}}]}]",
      true));
  REQUIRE(l.scene.shapes.size() == 1);
  REQUIRE(l.scene.instances.size() == 2);
  const auto& a = l.scene.instances[0];
  CHECK(a.name == "a");
  check_vec(transform_point(a.frame, {0, 0, 0}), {1, 3, 3});
  check_vec(transform_vector(a.frame, {1, 0, 0}), {0, 2, 0});
  check_vec(transform_vector(a.frame, {0, 1, 0}), {-3, 0, 0});
  check_vec(transform_point(l.scene.instances[1].frame, {0, 0, 0}), {-4, 2, 3});
  CHECK(l.scene.instances[1].shape == 0);
}

TEST_CASE("gltf: cameras") {
  auto l = load_text(R"({"asset":{"version":"2.0"},"nodes":[
    {"camera":0,"translation":[0,0,5],"scale":[3,3,3]},{"camera":1},{"camera":2,"name":"n"}],
    "cameras":[{"name":"wide","type":"perspective","perspective":{"yfov":0.6,"aspectRatio":2,"znear":0.1}},
    {"type":"perspective","perspective":{"yfov":0.6,"aspectRatio":0.5,"znear":0.1}},
    {"type":"orthographic","orthographic":{"xmag":3,"ymag":2,"zfar":10,"znear":0.1}}]})");
  REQUIRE(l.scene.cameras.size() == 3);
  const auto& wide = l.scene.cameras[0];
  CHECK(wide.name == "wide");
  CHECK(wide.aspect == 2);
  // the height of the film at this lens has the given angle
  CHECK(2 * std::atan(wide.film / 2 / (2 * wide.lens)) == doctest::Approx(0.6));
  check_vec(wide.frame[3], {0, 0, 5});
  check_vec(wide.frame[0], {1, 0, 0});  // scale does not matter to a camera
  const auto& tall = l.scene.cameras[1];
  CHECK(2 * std::atan(tall.film / (2 * tall.lens)) == doctest::Approx(0.6));
  const auto& flat = l.scene.cameras[2];
  CHECK(flat.name == "n");
  CHECK(flat.orthographic);
  CHECK(flat.aspect == doctest::Approx(1.5));
  CHECK(flat.film / flat.lens == doctest::Approx(6));  // the width of the view
  CHECK(contains(error_of(R"({"asset":{"version":"2.0"},"nodes":[{"camera":0}],"cameras":[
    {"type":"perspective","perspective":{"yfov":0,"znear":0.1}}]})"),
                 "yfov"));
}

TEST_CASE("gltf: punctual lights") {
  auto l = load_text(R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_lights_punctual"],
    "extensions":{"KHR_lights_punctual":{"lights":[
      {"type":"point","intensity":10,"color":[1,0.5,0],"range":4},
      {"type":"spot","spot":{"innerConeAngle":0.2,"outerConeAngle":0.4}},
      {"type":"directional","name":"sun","intensity":3},
      {"type":"area"}]}},
    "nodes":[{"extensions":{"KHR_lights_punctual":{"light":0}},"translation":[1,2,3]},
      {"extensions":{"KHR_lights_punctual":{"light":1}}},
      {"extensions":{"KHR_lights_punctual":{"light":2}},"rotation":[-0.70710678,0,0,0.70710678]},
      {"extensions":{"KHR_lights_punctual":{"light":3}}}]})");
  REQUIRE(l.scene.lights.size() == 3);
  CHECK(l.scene.lights[0].type == light_type::point);
  check_vec(l.scene.lights[0].intensity, {10, 5, 0});
  CHECK(l.scene.lights[0].range == 4);
  check_vec(l.scene.lights[0].frame[3], {1, 2, 3});
  CHECK(l.scene.lights[1].inner_cone == doctest::Approx(0.2));
  CHECK(l.scene.lights[1].outer_cone == doctest::Approx(0.4));
  CHECK(l.scene.lights[1].range == infinity);
  CHECK(l.scene.lights[2].name == "sun");
  check_vec(-l.scene.lights[2].frame[2], {0, -1, 0});  // it shines down
  CHECK(has_warning(l, "area"));
  CHECK(contains(error_of(R"({"asset":{"version":"2.0"},
    "nodes":[{"extensions":{"KHR_lights_punctual":{"light":0}}}]})"),
                 "light 0 does not exist"));
}

TEST_CASE("gltf: materials") {
  builder b;
  int p = b.vec3s(square);
  auto prim = [&](int material, const char* more = "") {
    return R"({"attributes":{"POSITION":)" + std::to_string(p) + R"(},"material":)" +
           std::to_string(material) + more + "}";
  };
  std::string materials = R"(,"materials":[
    {"name":"gold","pbrMetallicRoughness":{"baseColorFactor":[1,0.8,0.2,0.5],"metallicFactor":0.9,"roughnessFactor":0.3}},
    {"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.25]}},
    {"alphaMode":"MASK","alphaCutoff":0.6,"pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5]}},
    {"emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":8}}},
    {"extensions":{"KHR_materials_ior":{"ior":1.33},"KHR_materials_transmission":{"transmissionFactor":1}}},
    {"extensions":{"KHR_materials_transmission":{"transmissionFactor":1},
      "KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":2,"attenuationColor":[0.5,1,1]}}},
    {"pbrMetallicRoughness":{"baseColorFactor":[0.1,0.2,0.3,1]},"extensions":{"KHR_materials_unlit":{}}},
    {"pbrMetallicRoughness":{"baseColorFactor":[0.1,0.2,0.3,1]}}])";
  std::string prims;
  for (int i = 0; i < 7; i++) prims += prim(i) + ",";
  prims += prim(7, R"(,"mode":3)");
  auto l = load_text(b.json(mesh_scene(prims, materials), true));
  const auto& m = l.scene.materials;
  REQUIRE(m.size() == 8);
  CHECK(m[0].name == "gold");
  check_vec(m[0].color, {1, 0.8f, 0.2f});
  CHECK(m[0].opacity == 1);  // OPAQUE
  CHECK(m[0].metallic == doctest::Approx(0.9));
  CHECK(m[0].roughness == doctest::Approx(0.3));
  CHECK(m[1].opacity == 0.25f);
  CHECK(m[2].opacity == 0);
  check_vec(m[3].emission, {8, 4, 0});
  CHECK(m[4].type == material_type::transparent);
  CHECK(m[4].ior == doctest::Approx(1.33));
  CHECK(m[5].type == material_type::refractive);
  CHECK(m[5].trdepth == 2);
  check_vec(m[5].color, {0.5f, 1, 1});
  check_vec(m[6].emission, {0.1f, 0.2f, 0.3f});
  check_vec(m[6].color, {0, 0, 0});
  CHECK(m[7].type == material_type::hair);
  REQUIRE(m[7].hair.color);
  check_vec(*m[7].hair.color, {0.1f, 0.2f, 0.3f});
  CHECK(contains(error_of(b.json(mesh_scene(prim(9), materials), true)), "material 9"));
}

TEST_CASE("gltf: textures stay encoded until they are loaded") {
  temporary_folder folder;
  image_data image;
  image.width = image.height = 2;
  image.channels = {"R", "G", "B"};
  image.pixels.assign(12, 0.5f);
  save_image(folder.path / "a b.png", image);
  std::ifstream in(folder.path / "a b.png", std::ios::binary);
  std::string png{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  builder b;
  int p = b.vec3s(square);
  int t = b.floats({0, 0, 1, 0, 1, 1, 0, 1}, 2, "VEC2");
  int view = b.view(std::vector<char>(png.begin(), png.end()));
  auto transform =
      R"("extensions":{"KHR_texture_transform":{"offset":[0,1],"rotation":1.57079632679,"scale":[0.5,0.5]}})";
  auto text = b.json(
      mesh_scene(
          R"({"attributes":{"POSITION":)" + std::to_string(p) + R"(,"TEXCOORD_0":)" +
              std::to_string(t) + R"(},"material":0})",
          std::string(R"(,"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0,)") +
              transform + R"(},"metallicRoughnessTexture":{"index":1,)" + transform +
              R"(}},"normalTexture":{"index":2,)" + transform +
              R"(},"emissiveTexture":{"index":0,)" + transform +
              R"(},"emissiveFactor":[1,1,1]}],
      "textures":[{"source":0,"sampler":0},{"source":1},{"source":2}],
      "samplers":[{"magFilter":9728,"wrapS":33071,"wrapT":10497}],
      "images":[{"uri":"a%20b.png"},{"bufferView":)" +
              std::to_string(view) + R"(,"mimeType":"image/png"},{"uri":"data:image/png;base64,)" +
              base64(png) + R"("}])"),
      true);
  write_all(folder.path / "scene.gltf", text);
  warning_list warnings;
  auto scene = load_gltf_scene(folder.path / "scene.gltf", warnings);
  CHECK(warnings.empty());
  REQUIRE(scene.textures.size() >= 3);
  const auto& m = scene.materials.at(0);
  REQUIRE(m.color_tex >= 0);
  CHECK(m.roughness_tex >= 0);
  CHECK(m.normal_tex >= 0);
  CHECK(m.emission_tex >= 0);
  const auto& color = scene.textures[static_cast<std::size_t>(m.color_tex)];
  CHECK(color.nearest);
  CHECK(color.clamp_s);
  CHECK_FALSE(color.clamp_t);
  CHECK(color.width == 0);
  CHECK(load_textures(scene, std::vector<bool>(scene.textures.size(), true)) ==
        scene.textures.size() * 16);
  // The example of the extension's text: the lower left quadrant, rotated
  // clockwise by 90 degrees.
  const auto& uv = scene.shapes.at(0).texcoords;
  REQUIRE(uv.size() == 3);  // of one triangle
  vec2 want[] = {{0, 1}, {0, 0.5f}, {0.5f, 0.5f}};
  for (std::size_t i = 0; i < 3; i++) {
    CHECK(uv[i].x == doctest::Approx(want[i].x));
    CHECK(uv[i].y == doctest::Approx(want[i].y));
  }
}

TEST_CASE("gltf: opaque materials ignore the alpha of their texture") {
  // one pixel, grey 128 with alpha 0, as a PNG
  std::string png =
      "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAQAAAC1HAwCAAAAC0lEQVR4nGNoYAAAAQMAgT5MxZMAAAAASUVORK5CYII"
      "=";
  builder b;
  int p = b.vec3s(square);
  for (std::string mode : {"OPAQUE", "BLEND"}) {
    auto l = load_text(b.json(
        mesh_scene(R"({"attributes":{"POSITION":)" + std::to_string(p) + R"(},"material":0})",
                   R"(,"materials":[{"alphaMode":")" + mode +
                       R"(","pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
        "textures":[{"source":0}],"images":[{"uri":"data:image/png;base64,)" +
                       png + R"("}])"),
        true));
    REQUIRE(l.scene.textures.size() == 1);
    auto& texture = l.scene.textures[0];
    load_textures(l.scene, {true});
    REQUIRE(texture.pixelsb.size() == 1);
    CHECK(texture.pixelsb[0] == u8vec4{128, 128, 128, mode == "OPAQUE" ? 255 : 0});
  }
}
