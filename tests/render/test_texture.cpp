#include <doctest/doctest.h>

#include <limits>

#include "wisp/core/rng.h"
#include "wisp/render/image.h"

using namespace wisp;

namespace {

// 4 by 2 texels, all different; float.
texture_data make_texture() {
  texture_data texture;
  texture.width = 4;
  texture.height = 2;
  for (int j = 0; j < 2; j++)
    for (int i = 0; i < 4; i++)
      texture.pixelsf.push_back({float(i), float(j), float(10 * i + j), float(i) / 4});
  return texture;
}

double srgb(double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); }

bool close(const vec4& a, const vec4& b, float tolerance = 1e-4f) {
  return glm::length(a - b) <= tolerance;
}

}  // namespace

TEST_CASE("texture: texel centres lie at half-integers") {
  auto texture = make_texture();
  for (bool nearest : {false, true}) {
    texture.nearest = nearest;
    for (int j = 0; j < 2; j++)
      for (int i = 0; i < 4; i++) {
        vec2 uv = {(float(i) + 0.5f) / 4, (float(j) + 0.5f) / 2};
        CHECK(eval_texture(texture, uv, false) == texture.pixelsf[std::size_t(4 * j + i)]);
      }
  }
}

TEST_CASE("texture: bilinear between centres, linear textures of any flag alike") {
  auto texture = make_texture();
  vec4 value = eval_texture(texture, {(1.5f + 0.25f) / 4, 0.5f}, false);
  CHECK(close(value, {1.25f, 0.5f, 13, 1.25f / 4}));
  CHECK(eval_texture(texture, {0.4f, 0.3f}, true) == eval_texture(texture, {0.4f, 0.3f}, false));
}

TEST_CASE("texture: repeats or clamps along each axis") {
  auto texture = make_texture();
  // Half way between the last column and the first.
  CHECK(close(eval_texture(texture, {0, 0.25f}, false), {1.5f, 0, 15, 0.375f}));
  CHECK(close(eval_texture(texture, {1, 0.25f}, false), {1.5f, 0, 15, 0.375f}));
  CHECK(close(eval_texture(texture, {-3, 0.25f}, false), {1.5f, 0, 15, 0.375f}));
  // From the last column on into the first.
  CHECK(close(eval_texture(texture, {0.975f, 0.25f}, false), {1.8f, 0, 18, 0.45f}));
  CHECK(close(eval_texture(texture, {0.375f, 0.95f}, false), {1, 0.6f, 10.6f, 0.25f}));
  for (float u : {-5.0f, -1.0f, 2.0f, 11.0f})
    CHECK(close(eval_texture(texture, {u + 0.3f, 0.6f}, false),
                eval_texture(texture, {0.3f, 0.6f}, false)));
  texture.clamp_s = true;
  for (float u : {-1e30f, -5.0f, -0.01f, 0.0f, 0.1f})
    CHECK(eval_texture(texture, {u, 0.25f}, false) == texture.pixelsf[0]);
  for (float u : {0.9f, 1.0f, 1.5f, 1e30f})
    CHECK(eval_texture(texture, {u, 0.25f}, false) == texture.pixelsf[3]);
  // t still repeats.
  CHECK(close(eval_texture(texture, {0, 0}, false), {0, 0.5f, 0.5f, 0}));
  texture.clamp_t = true;
  CHECK(eval_texture(texture, {0, 0}, false) == texture.pixelsf[0]);
  CHECK(eval_texture(texture, {0, 2}, false) == texture.pixelsf[4]);
  texture.nearest = true;
  CHECK(eval_texture(texture, {1, 1}, false) == texture.pixelsf[7]);
  CHECK(eval_texture(texture, {-1, -1}, false) == texture.pixelsf[0]);
  texture.clamp_s = texture.clamp_t = false;
  CHECK(eval_texture(texture, {-0.1f, 1.1f}, false) == texture.pixelsf[3]);
}

TEST_CASE("texture: colours of 8 bits are decoded before they are mixed, alpha never") {
  texture_data texture;
  texture.width = 256;
  texture.height = 1;
  for (int i = 0; i < 256; i++) {
    auto b = uint8_t(i);
    texture.pixelsb.push_back({b, uint8_t(255 - i), 0, b});
  }
  for (int i = 0; i < 256; i++) {
    vec2 uv = {(float(i) + 0.5f) / 256, 0.5f};
    vec4 color = eval_texture(texture, uv, false), plain = eval_texture(texture, uv, true);
    CHECK(double(color.x) == doctest::Approx(srgb(i / 255.0)).epsilon(1e-6));
    CHECK(double(color.y) == doctest::Approx(srgb((255 - i) / 255.0)).epsilon(1e-6));
    CHECK(color.z == 0);
    CHECK(double(color.w) == doctest::Approx(i / 255.0).epsilon(1e-6));
    CHECK(double(plain.x) == doctest::Approx(i / 255.0).epsilon(1e-6));
    CHECK(plain.x == plain.w);
  }
  texture.width = 2;
  texture.pixelsb = {{0, 0, 0, 0}, {255, 255, 255, 255}};
  CHECK(close(eval_texture(texture, {0.5f, 0.5f}, false), vec4(0.5f), 1e-6f));
}

TEST_CASE("texture: any coordinate gives a finite value of the range") {
  auto texture = make_texture();
  const float special[] = {0.0f,
                           -0.0f,
                           1.0f,
                           -1.0f,
                           -1e-9f,
                           -1e-38f,
                           1 - 0x1p-24f,
                           -1 + 0x1p-24f,
                           1e7f,
                           -1e7f,
                           8388608.5f,
                           1e30f,
                           -1e30f,
                           std::numeric_limits<float>::max(),
                           std::numeric_limits<float>::lowest(),
                           std::numeric_limits<float>::denorm_min(),
                           -std::numeric_limits<float>::denorm_min(),
                           infinity,
                           -infinity,
                           std::numeric_limits<float>::quiet_NaN()};
  auto check = [](const texture_data& t, const vec2& uv) {
    vec4 v = eval_texture(t, uv, false);
    // False for NaN as well.
    return v.x >= 0 && v.x <= 3.0001f && v.y >= 0 && v.y <= 1.0001f && v.w >= 0 && v.w <= 1;
  };
  rng_state rng = make_rng(1);
  for (int mode = 0; mode < 8; mode++) {
    texture.nearest = mode & 1;
    texture.clamp_s = mode & 2;
    texture.clamp_t = mode & 4;
    for (float u : special)
      for (float v : special) CHECK(check(texture, {u, v}));
    int bad = 0;
    for (int k = 0; k < 20000; k++) {
      float a = rand1f(rng) - 0.5f, b = rand1f(rng) - 0.5f;
      float scale = std::pow(10.0f, rand1f(rng) * 20 - 5);
      bad += !check(texture, {a * scale, b * scale});
    }
    CHECK(bad == 0);
  }
  texture.width = texture.height = 1;  // one texel is all there is
  CHECK(eval_texture(texture, {0.1f, -7.3f}, false) == texture.pixelsf[0]);
}

TEST_CASE("texture: one without its pixels counts as none") {
  texture_data texture;
  CHECK(eval_texture(texture, {0.5f, 0.5f}, false) == vec4{1, 1, 1, 1});
  texture.width = texture.height = 16;
  CHECK(eval_texture(texture, {0.5f, 0.5f}, false) == vec4{1, 1, 1, 1});
  texture.pixelsb.resize(3);
  CHECK(eval_texture(texture, {0.5f, 0.5f}, false) == vec4{1, 1, 1, 1});
}
