#include <doctest/doctest.h>

#include <cmath>
#include <set>
#include <tuple>

#include "wisp/render/tesselate.h"

using namespace wisp;

namespace {

// A cube of side 2 whose faces have texture coordinates of their own.
scene_data make_scene(int subdivisions) {
  scene_data scene;
  scene.path = "scene.json";
  scene.shapes.resize(2);
  scene.shapes[0].name = "ball";
  scene.shapes[1].positions = {{5, 5, 5}};
  scene.materials.resize(1);
  scene.instances.push_back({"", identity_frame, 0, 0});
  subdiv_data subdiv;
  subdiv.shape = 0;
  subdiv.subdivisions = subdivisions;
  subdiv.quadspos = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                     {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  subdiv.positions = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                      {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  subdiv.texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  subdiv.quadstexcoord.assign(6, {0, 1, 2, 3});
  scene.subdivs.push_back(subdiv);
  return scene;
}

texture_data make_texture(bool floats, float value) {
  texture_data texture;
  texture.width = texture.height = 1;
  if (floats)
    texture.pixelsf = {vec4{value, value, value, 1}};
  else
    texture.pixelsb = {u8vec4{static_cast<unsigned char>(value), static_cast<unsigned char>(value),
                              static_cast<unsigned char>(value), 255}};
  return texture;
}

float largest_radius(const shape_data& shape) {
  float r = 0;
  for (const auto& p : shape.positions) r = std::max(r, glm::length(p));
  return r;
}

}  // namespace

TEST_CASE("render tesselate: a subdiv replaces the shape that an instance uses") {
  auto scene = make_scene(3);
  tesselate_subdivs(scene);
  const auto& shape = scene.shapes[0];
  CHECK(shape.name == "ball");
  CHECK(shape.quads.size() == 6 * 64);
  CHECK(shape.positions.size() == shape.normals.size());
  CHECK(shape.positions.size() == shape.texcoords.size());
  for (std::size_t i = 0; i < shape.positions.size(); i++) {
    CHECK(glm::length(shape.normals[i]) == doctest::Approx(1));
    CHECK(glm::dot(shape.normals[i], glm::normalize(shape.positions[i])) > 0.9f);
    CHECK(shape.texcoords[i].x >= 0);
    CHECK(shape.texcoords[i].x <= 1);
  }
  CHECK(scene.shapes[1].positions.size() == 1);  // of nobody's subdiv
}

TEST_CASE("render tesselate: corners that agree are one vertex") {
  auto scene = make_scene(0);
  scene.subdivs[0].smooth = false;
  tesselate_subdivs(scene);
  std::set<std::tuple<float, float, float, float, float>> distinct;
  const auto& s = scene.shapes[0];
  for (std::size_t i = 0; i < s.positions.size(); i++)
    distinct.insert(
        {s.positions[i].x, s.positions[i].y, s.positions[i].z, s.texcoords[i].x, s.texcoords[i].y});
  CHECK(distinct.size() == s.positions.size());
  CHECK(s.positions.size() < 24);
  CHECK(s.normals.empty());

  scene = make_scene(0);
  scene.subdivs[0].texcoords = {};
  scene.subdivs[0].quadstexcoord = {};
  tesselate_subdivs(scene);
  CHECK(scene.shapes[0].positions.size() == 8);
  CHECK(scene.shapes[0].texcoords.empty());
}

TEST_CASE("render tesselate: shapes of no instance stay as they are") {
  auto scene = make_scene(3);
  scene.instances[0].shape = 1;
  tesselate_subdivs(scene);
  CHECK(scene.shapes[0].quads.empty());
}

TEST_CASE("render tesselate: displacement by float and by 8-bit textures") {
  auto plain = make_scene(4);
  tesselate_subdivs(plain);
  float r = largest_radius(plain.shapes[0]);

  auto displaced = [&](texture_data texture) {
    auto scene = make_scene(4);
    scene.textures.push_back(std::move(texture));
    scene.subdivs[0].displacement = 0.5f;
    scene.subdivs[0].displacement_tex = 0;
    tesselate_subdivs(scene);
    return largest_radius(scene.shapes[0]);
  };
  CHECK(displaced(make_texture(true, 0)) == doctest::Approx(r));
  CHECK(displaced(make_texture(true, 1)) == doctest::Approx(r + 0.5f).epsilon(0.01));
  // 8-bit values are not decoded: half of 255 moves next to nothing.
  CHECK(displaced(make_texture(false, 128)) == doctest::Approx(r).epsilon(0.003));
  CHECK(displaced(make_texture(false, 255)) == doctest::Approx(r + 0.25f).epsilon(0.01));
  CHECK(displaced(make_texture(false, 0)) < r);
}

TEST_CASE("render tesselate: triangles in one topology and not in the other") {
  // All corners share one texture coordinate, so that its face looks like a
  // triangle; and a triangle by position has four texture coordinates.
  auto scene = make_scene(2);
  scene.subdivs[0].quadstexcoord[0] = {2, 2, 2, 2};
  scene.subdivs[0].quadspos[1] = {4, 5, 6, 6};
  tesselate_subdivs(scene);
  CHECK(scene.shapes[0].quads.size() == (5 * 4 + 3) * 4);
  CHECK(scene.shapes[0].texcoords.size() == scene.shapes[0].positions.size());
}

TEST_CASE("render tesselate: what is impossible is said with its place") {
  auto place = [](scene_data scene) -> std::string {
    try {
      tesselate_subdivs(scene);
    } catch (const file_error& e) {
      CHECK(e.file == "scene.json");
      return e.place;
    }
    return "no error";
  };
  auto scene = make_scene(30);
  CHECK(place(scene) == "subdivs[0].subdivisions");
  CHECK(count_subdiv_faces(scene.subdivs[0]) > max_subdiv_faces);
  CHECK(count_subdiv_faces(make_scene(2).subdivs[0]) == 96);
  scene = make_scene(1);
  scene.subdivs[0].quadspos[3].y = 8;
  CHECK(place(scene) == "subdivs[0]");
  scene = make_scene(1);
  scene.subdivs[0].quadstexcoord.pop_back();
  CHECK(place(scene) == "subdivs[0]");
  scene = make_scene(1);
  scene.subdivs[0].displacement = 1;
  scene.subdivs[0].displacement_tex = 0;
  CHECK(place(scene) == "subdivs[0].displacement_tex");
  scene.textures.resize(1);  // not loaded
  CHECK(place(scene) == "subdivs[0].displacement_tex");
  scene.textures[0] = make_texture(true, 1);
  CHECK(place(scene) == "no error");
  scene.subdivs[0].quadstexcoord = {};
  CHECK(place(scene) == "subdivs[0].displacement_tex");
}
