#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include "json_folder.h"
#include "wisp/scene/io.h"

using namespace wisp;
using namespace json_test;

TEST_CASE("scene json: a scene of Yocto/GL with all its elements") {
  scene_folder folder;
  auto scene = folder.load(R"({
    "asset": {"version": "4.2", "generator": "someone", "copyright": "public domain"},
    "cameras": [{"name": "main", "frame": [1,0,0, 0,1,0, 0,0,1, 1,2,3], "orthographic": true,
                 "lens": 0.1, "film": 0.024, "aspect": 2, "focus": 5, "aperture": 0.5},
                {"lookat": [0,0,5, 0,0,1, 0,1,0]}],
    "environments": [{"name": "sky", "emission": [1,2,3], "emission_tex": 0}],
    "textures": [{"name": "sky", "uri": "textures/sky.hdr"}],
    "shapes": [{"name": "unused", "uri": "shapes/absent.ply"}, {"name": "floor", "uri": "shapes/quad.ply"}],
    "subdivs": [],
    "materials": [{"name": "red", "type": "volume", "color": [1,0,0], "roughness": 0.5, "ior": 1.3,
                   "trdepth": 2, "scattering": [0.1,0.2,0.3], "scanisotropy": -0.5,
                   "opacity": 0.25, "metallic": 0.75, "emission": [4,5,6], "color_tex": 0, "normal_tex": -1}],
    "instances": [{"name": "floor", "frame": [2,0,0, 0,2,0, 0,0,2, 0,0,7], "shape": 1, "material": 0}]})");
  CHECK(scene.copyright == "public domain");
  REQUIRE(scene.cameras.size() == 2);
  const auto& c = scene.cameras[0];
  CHECK(c.name == "main");
  CHECK(c.orthographic);
  CHECK(c.frame[3] == vec3{1, 2, 3});
  CHECK(c.lens == 0.1f);
  CHECK(c.film == 0.024f);
  CHECK(c.aspect == 2);
  CHECK(c.focus == 5);
  CHECK(c.aperture == 0.5f);
  CHECK(scene.cameras[1].frame ==
        frame3{vec3{1, 0, 0}, vec3{0, 1, 0}, vec3{0, 0, 1}, vec3{0, 0, 5}});
  CHECK(scene.cameras[1].focus == 4);
  CHECK(scene.environments.at(0).emission == vec3{1, 2, 3});
  CHECK(scene.environments[0].emission_tex == 0);
  CHECK(scene.textures.at(0).path == folder.path / "textures/sky.hdr");
  const auto& m = scene.materials.at(0);
  CHECK(m.type == material_type::volumetric);
  CHECK(m.color == vec3{1, 0, 0});
  CHECK(m.roughness == 0.5f);
  CHECK(m.ior == 1.3f);
  CHECK(m.trdepth == 2);
  CHECK(m.scattering == vec3{0.1f, 0.2f, 0.3f});
  CHECK(m.scanisotropy == -0.5f);
  CHECK(m.opacity == 0.25f);
  CHECK(m.metallic == 0.75f);
  CHECK(m.emission == vec3{4, 5, 6});
  CHECK(m.color_tex == 0);
  CHECK(m.normal_tex == invalid_id);
  REQUIRE(scene.shapes.size() == 2);
  CHECK(scene.shapes[0].name == "unused");
  CHECK(scene.shapes[0].positions.empty());
  CHECK(scene.shapes[1].positions.size() == 4);
  CHECK(scene.instances.at(0).shape == 1);
  auto bounds = scene_bounds(scene);
  CHECK(bounds[0] == vec3{0, 0, 7});
  CHECK(bounds[1] == vec3{2, 2, 7});
}

TEST_CASE("scene json: defaults, an empty scene and comments") {
  scene_folder folder;
  auto scene = folder.load(
      R"({"_comment": 1, "$schema": "x", "cameras": [{}], "materials": [{}], "lights": [{}]})");
  CHECK(scene.cameras.at(0).lens == 0.05f);
  CHECK(scene.cameras[0].frame == identity_frame);
  CHECK(scene.materials.at(0).type == material_type::matte);
  CHECK(scene.materials[0].color == vec3{0, 0, 0});
  CHECK(scene.materials[0].trdepth == 0.01f);
  CHECK(scene.lights.at(0).type == light_type::point);
  CHECK(std::isinf(scene.lights[0].range));
  CHECK(folder.load("{}").instances.empty());
  CHECK(folder.load("\xef\xbb\xbf {}").instances.empty());
}

TEST_CASE("scene json: names of material types from all versions") {
  scene_folder folder;
  for (auto [name, type] : std::initializer_list<std::pair<const char*, material_type>>{
           {"matte", material_type::matte},
           {"plastic", material_type::glossy},
           {"metallic", material_type::reflective},
           {"metal", material_type::reflective},
           {"reflective", material_type::reflective},
           {"transparent", material_type::transparent},
           {"glass", material_type::refractive},
           {"refractive", material_type::refractive},
           {"subsurface", material_type::subsurface},
           {"volumetric", material_type::volumetric},
           {"principled", material_type::gltfpbr},
           {"hair", material_type::hair}})
    CHECK(folder.load(material(R"("type": ")" + std::string(name) + '"')).materials[0].type ==
          type);
  CHECK(has(folder.error(material(R"("type": "reflectiv")")),
            "materials[0].type: is 'reflectiv'; it must be one of matte, glossy, reflective, "
            "transparent, refractive, subsurface, volumetric, gltfpbr, hair, principled_hair, "
            "chiang_hair_bsdf; did you mean 'reflective'?"));
}

TEST_CASE("scene json: version 4.1, keyed by name") {
  scene_folder folder;
  auto scene = folder.load(R"({
    "asset": {"version": "4.1"},
    "cameras": {"zoom": {"ortho": true}, "a": {}},
    "textures": {"wood": "wood.png"},
    "shapes": {"q": {"datafile": "quad.ply"}},
    "materials": {"m": {"color_tex": "wood"}},
    "instances": {"i": {"shape": "q", "material": "m"}}})");
  CHECK(scene.cameras.at(0).name == "zoom");
  CHECK(scene.cameras[0].orthographic);
  CHECK(scene.textures.at(0).path == folder.path / "textures" / "wood.png");
  CHECK(scene.materials.at(0).color_tex == 0);
  CHECK(scene.instances.at(0).name == "i");
  CHECK(scene.shapes.at(0).positions.size() == 4);
  CHECK(has(folder.error(R"({"asset": {"version": "4.0"}})"), "asset.version"));
  CHECK(has(folder.error(R"({"objects": {}})"), "before 4.1"));
  CHECK(has(folder.error(R"({"asset": {"version": "2.0"}})"), ".gltf"));
  CHECK(has(folder.warning(R"({"asset": {"version": "5.7"}})"), "5.7"));
}

TEST_CASE("scene json: wrong values name their place and what would be right") {
  scene_folder folder;
  CHECK(has(folder.error(material(R"("color": 3)")),
            "materials[0].color: is the number 3; it must be an array of 3 numbers"));
  CHECK(has(folder.error(material(R"("color": [1, 2])")), "materials[0].color: is an array of 2"));
  CHECK(has(folder.error(material(R"("color": [1, "a", 2])")),
            "materials[0].color[1]: is the text 'a'"));
  CHECK(has(folder.error(material(R"("color": [1, null, 2])")), "materials[0].color[1]: is null"));
  CHECK(has(folder.error(material(R"("color": [1, -2, 2])")), "at least 0"));
  CHECK(has(folder.error(material(R"("color": [1, 1e39, 2])")),
            "materials[0].color[1]: is too large"));
  CHECK(has(folder.error(material(R"("name": 1)")), "materials[0].name"));
  CHECK(has(folder.error(material(R"("opacity": 1.5)")), "in [0, 1]"));
  CHECK(has(folder.error(material(R"("scanisotropy": 1)")), "in (-1, 1)"));
  CHECK(has(folder.error(material(R"("scanisotropy": 0.99999999999)")), "in (-1, 1)"));
  CHECK(
      has(folder.error(material(R"("type": "volumetric", "trdepth": 0)")), "materials[0].trdepth"));
  CHECK(folder.load(material(R"("trdepth": 0)")).materials[0].trdepth == 0.01f);
  CHECK(has(folder.error(material(R"("color_tex": 0)")), "has no \"textures\""));
  CHECK(has(folder.error(R"({"cameras": [{"lens": 0}]})"),
            "cameras[0].lens: is 0; it must be greater than 0"));
  CHECK(has(folder.error(R"({"cameras": [{"aspect": -1}]})"), "cameras[0].aspect"));
  CHECK(has(folder.error(R"({"cameras": [{"orthographic": 1}]})"), "true or false"));
  CHECK(has(folder.error(R"({"cameras": [{"frame": [1,2,3]}]})"), "array of 12 numbers"));
  CHECK(has(folder.error(R"({"cameras": [{"frame": [1,0,0,1,0,0,0,0,1,0,0,0]}]})"),
            "cameras[0].frame"));
  CHECK(has(folder.error(R"({"cameras": [{"lookat": [1,1,1,1,1,1,0,1,0]}]})"), "to itself"));
  CHECK(has(folder.error(R"({"cameras": [{"lookat": [0,5,0,0,0,0,0,1,0]}]})"), "up vector"));
  CHECK(has(folder.error(R"({"cameras": [3]})"), "cameras[0]: is the number 3"));
  CHECK(has(folder.error(R"({"cameras": 3})"), "cameras: "));
  CHECK(has(folder.error(R"({"textures": [{}]})"), "textures[0].uri"));
  CHECK(has(folder.error(R"({"subdivs": [{"uri": "a.obj"}]})"), "subdivs[0].shape"));
  CHECK(
      has(folder.error(R"({"subdivs": [{"uri": "a.obj", "subdivisions": 1.5}]})"), "whole number"));
  CHECK(
      has(folder.error(R"({"subdivs": [{"uri": "a.obj", "subdivisions": 1e300}]})"), "from 0 to"));
  CHECK(has(folder.error(R"([])"), "must be an object"));
}

TEST_CASE("scene json: references by index and by name") {
  scene_folder folder;
  std::string head =
      R"({"shapes": [{"name": "quad", "uri": "shapes/quad.ply"}, {"name": "quad"}, {"uri": "shapes/none.ply"}, {}],
      "materials": [{"name": "red"}, {"name": "red"}], "instances": [)";
  auto scene =
      folder.load(head + R"({"shape": "quad", "material": "red"}, {"shape": 0, "material": 1}]})");
  CHECK(scene.instances.at(0).shape == 0);
  CHECK(scene.instances[0].material == 0);
  CHECK(scene.instances.at(1).material == 1);
  auto error = [&](const std::string& instance) { return folder.error(head + instance + "]}"); };
  CHECK(has(error(R"({"shape": 4, "material": 0})"),
            "instances[0].shape: is 4; the scene has 4 \"shapes\", so it must be from 0 to 3"));
  CHECK(has(error(R"({"shape": -2, "material": 0})"), "instances[0].shape"));
  CHECK(has(error(R"({"shape": 0.5, "material": 0})"), "instances[0].shape"));
  CHECK(has(error(R"({"shape": 1e300, "material": 0})"), "instances[0].shape"));
  CHECK(has(error(R"({"shape": "quat", "material": 0})"), "did you mean 'quad'?"));
  CHECK(has(error(R"({"shape": true, "material": 0})"), "instances[0].shape"));
  CHECK(has(error(R"({"material": 0})"), "instances[0].shape: is missing"));
  CHECK(has(error(R"({"shape": 0})"), "instances[0].material: is missing"));
  CHECK(has(error(R"({"shape": 2, "material": 0})"), "shapes[2].uri: there is no file"));
  CHECK(has(error(R"({"shape": 3, "material": 0})"), "shapes[3]: has neither"));
}

TEST_CASE("scene json: unknown keys") {
  scene_folder folder;
  CHECK(has(folder.warning(material(R"("colour": [1,1,1])")),
            "scene.json: materials[0].colour: unknown key, ignored; did you mean 'color'?"));
  CHECK(has(folder.warning(R"({"matrials": []})"),
            "scene.json: matrials: unknown key, ignored; did you mean 'materials'?"));
  CHECK(!folder.warning(material(R"("zzzzzz": 1)")).ends_with("?"));
  CHECK(has(folder.warning(R"({"materials": [{"a1": 1}, {"a1": 1}, {"a1": 2}]})"),
            "materials[0].a1: unknown key, ignored (here and in 2 more)"));
  std::string many = R"({"materials": [{)";
  for (int i = 0; i < 5000; i++) many += "\"key" + std::to_string(i) + "\": 1,";
  many += R"("name": "x"}]})";
  warning_list warnings;
  folder.load(many, warnings);
  CHECK(warnings.size() < 200);
}

TEST_CASE("scene json: text that is not JSON") {
  scene_folder folder;
  CHECK(has(folder.error("{\n  \"a\": 1,\n  \"b\" 2\n}"), "line 3, column 7: "));
  CHECK(has(folder.error("{\"a\": [1, 2"), "line 1, column 12: "));
  CHECK(has(folder.error("{\n\"a\": 1e999}"), "line 2, column 6: number overflow"));
  CHECK(has(folder.error("{\"a\": NaN}"), "line 1, column 7: "));
  CHECK(has(folder.error(""), "is empty"));
  CHECK(has(folder.error(" \n\n"), "is empty"));
  CHECK(has(folder.error("ply\nformat"), "line 1, column 1: is not a JSON text"));
  CHECK(has(folder.error(std::string("{\0}", 3)), "is not a JSON text"));
  CHECK(has(folder.error("{\"a\": \"\xff\xfe\"}"), "UTF-8"));
  CHECK(has(folder.error("{} {}"), "line 1, column 4"));
  CHECK(has(folder.error("{\"a\": \"" + std::string(1 << 20, 'x')), "line 1"));
  CHECK(folder.error("{\"a\": \"" + std::string(1 << 20, 'x')).size() < 500);
  CHECK(has(folder.error(std::string(100000, '[')), "line 1, column 201: brackets are nested"));
  std::string deep;
  for (int i = 0; i < 100000; i++) deep += "{\"a\":";
  CHECK(has(folder.error(deep), "nested"));
  CHECK(folder.error("{\"_\": \"" + std::string(300, '[') + "\\\"[\"}") == "no error");
  warning_list warnings;
  CHECK_THROWS_AS(load_json_scene(folder.path / "absent.json", warnings), file_error);
  CHECK_THROWS_AS(load_json_scene(folder.path, warnings), file_error);
}

TEST_CASE("scene json: lights") {
  scene_folder folder;
  auto scene = folder.load(R"({"lights": [
    {"name": "lamp", "type": "spot", "position": [1,2,3], "direction": [0,-2,0], "intensity": [5,6,7],
     "range": 10, "inner_cone": 10, "outer_cone": 20},
    {"type": "directional", "lookat": [0,0,1, 0,0,0, 0,1,0]}]})");
  const auto& spot = scene.lights.at(0);
  CHECK(spot.type == light_type::spot);
  CHECK(spot.frame[3] == vec3{1, 2, 3});
  CHECK(glm::length(spot.frame[2] - vec3{0, 1, 0}) < 1e-6f);  // shines along -z
  CHECK(std::abs(glm::determinant(rotation(spot.frame)) - 1) < 1e-5f);
  CHECK(spot.intensity == vec3{5, 6, 7});
  CHECK(spot.range == 10);
  CHECK(spot.inner_cone == doctest::Approx(10 * pi / 180));
  CHECK(spot.outer_cone == doctest::Approx(20 * pi / 180));
  CHECK(scene.lights.at(1).frame[2] == vec3{0, 0, 1});
  CHECK(has(folder.error(R"({"lights": [{"direction": [0,0,0]}]})"), "lights[0].direction"));
  CHECK(has(folder.error(R"({"lights": [{"type": "spot", "inner_cone": 50}]})"),
            "lights[0].inner_cone"));
  CHECK(has(
      folder.error(R"({"lights": [{"position": [0,0,0], "frame": [1,0,0,0,1,0,0,0,1,0,0,0]}]})"),
      "lights[0].position"));
  CHECK(has(folder.warning(R"({"lights": [{"outer_cone": 50}]})"), "only spot"));
}

TEST_CASE("scene json: an instance without volume is left out") {
  scene_folder folder;
  warning_list warnings;
  auto scene = folder.load(R"({"shapes": [{"uri": "shapes/quad.ply"}], "materials": [{}],
    "instances": [{"shape": 0, "material": 0, "frame": [0,0,0,0,0,0,0,0,0,1,1,1]}]})",
                           warnings);
  CHECK(warnings.size() == 1);
  CHECK(scene.instances.empty());
}

TEST_CASE("scene json: truncated and mutated text never does worse than file_error") {
  scene_folder folder;
  std::string text = groom(R"(, "curl": {"radius": 0.01, "turns": 1}, "length": [0.1, 0.2])");
  auto survives = [&](const std::string& t) {
    warning_list warnings;
    try {
      folder.load(t, warnings);
    } catch (const file_error&) {
    }
  };
  for (std::size_t n = 0; n < text.size(); n += 3) survives(text.substr(0, n));
  std::minstd_rand random(1);
  const std::string alphabet = "[]{},:\"0123456789-e.truefalsn\\ \n\xff";
  for (int i = 0; i < 500; i++) {
    std::string t = text;
    for (int k = 0; k < 2; k++) t[random() % t.size()] = alphabet[random() % alphabet.size()];
    if (t.find("e9") == std::string::npos) survives(t);
  }
  CHECK(folder.load(text).shapes.size() == 2);
}

TEST_CASE("scene json: bounds and the default camera") {
  scene_data scene;
  auto bounds = scene_bounds(scene);
  CHECK(bounds[0].x > bounds[1].x);
  CHECK(is_finite(default_camera(scene).frame[3]));

  shape_data shape;
  shape.positions = {{-1, -2, -3}, {1, 2, 3}, {4, std::nanf(""), 0}, {100, 100, 100}};
  shape.points = {0, 1, 2};  // not the last vertex
  shape.radius = {0.5f, 0.5f, 0.5f, 0.5f};
  scene.shapes.push_back(shape);
  scene.instances.push_back(
      {"", frame3{vec3{2, 0, 0}, vec3{0, 2, 0}, vec3{0, 0, 2}, vec3{10, 0, 0}}, 0, 0});
  bounds = scene_bounds(scene);
  CHECK(glm::length(bounds[0] - vec3{7, -5, -7}) < 1e-5f);
  CHECK(glm::length(bounds[1] - vec3{13, 5, 7}) < 1e-5f);
  auto camera = default_camera(scene);
  float tangent = camera.film / 2 / camera.lens;
  CHECK(std::atan(tangent) * 2 == doctest::Approx(35 * pi / 180));
  for (int i = 0; i < 8; i++) {
    vec3 p{bounds[i & 1].x, bounds[(i >> 1) & 1].y, bounds[(i >> 2) & 1].z};
    vec3 local = p - camera.frame[3];
    CHECK(local.z < 0);
    CHECK(std::abs(local.x) <= -local.z * tangent);
    CHECK(std::abs(local.y) <= -local.z * tangent / camera.aspect);
  }
}

TEST_CASE("scene json: the scenes that ship with Yocto/GL load without a warning") {
  const char* data = std::getenv("WISP_TEST_DATA");
  if (data == nullptr) {
    MESSAGE("skipped: WISP_TEST_DATA is not set");
    return;
  }
  int loaded = 0;
  for (const char* name : {"features1", "materials1", "shapes1"}) {
    fs::path path = fs::path(data) / "yocto" / name / (std::string(name) + ".json");
    if (!fs::exists(path)) continue;
    warning_list warnings;
    auto scene = load_json_scene(path, warnings);
    for (const auto& w : warnings) FAIL_CHECK("unexpected warning: ", w);
    CHECK(!scene.instances.empty());
    CHECK(scene_bounds(scene)[0].x < scene_bounds(scene)[1].x);
    for (const auto& instance : scene.instances)
      CHECK(!scene.shapes[static_cast<std::size_t>(instance.shape)].positions.empty());
    loaded++;
  }
  CHECK(loaded > 0);
}
