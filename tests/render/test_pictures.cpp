// Small renders against stored ones of 4096 samples (pictures/update.sh). The
// tolerance follows from the noise: means over blocks of 8 x 8 pixels and over the
// picture differ by at most 5 standard errors, both pictures' own. Those are upper
// estimates (stratified samples do better), so a false alarm has a probability below
// 6e-7 for each of the 100 or so means of a picture, 1e-4 in all.

#include <doctest/doctest.h>

#include <cstdlib>
#include <functional>
#include <string>

#include "wisp/render/gltf.h"
#include "wisp/render/image.h"
#include "wisp/render/trace.h"

using namespace wisp;

namespace {

std::string scene_path(const std::string& name) {
  std::string own = std::string(WISP_TEST_PICTURES) + "/" + name + ".json";
  return std::filesystem::exists(own) ? own : std::string(WISP_TEST_SCENES) + "/" + name + ".json";
}

image_data render(const std::string& name,
                  const std::function<void(scene_data&, trace_options&)>& change) {
  warning_list warnings;
  scene_data data = load_scene(scene_path(name), warnings);
  trace_options options;
  options.width = 48;
  options.samples = 256;
  options.filter = pixel_filter::box;
  options.error_image = true;
  options.seed = 5;
  change(data, options);
  render_scene scene = prepare_scene(std::move(data), {}, warnings);
  CHECK(warnings.empty());
  trace_state state = make_trace_state(scene, options);
  trace_image(state, scene, options);
  CHECK(state.paths_with_errors == 0);
  return get_image(state);
}

// The largest difference of a block's or the picture's mean, in standard errors.
double worst_difference(const image_data& a, const image_data& b) {
  REQUIRE(a.width == b.width);
  REQUIRE(a.height == b.height);
  auto channel = [](const image_data& image, const std::string& name) {
    auto it = std::find(image.channels.begin(), image.channels.end(), name);
    REQUIRE(it != image.channels.end());
    return std::size_t(it - image.channels.begin());
  };
  struct mean {
    double difference = 0, variance = 0;
  };
  int columns = (a.width + 7) / 8, rows = (a.height + 7) / 8;
  double worst = 0;
  for (const char* name : {"R", "G", "B"}) {
    std::vector<mean> means(std::size_t(columns * rows + 1));
    for (int y = 0; y < a.height; y++)
      for (int x = 0; x < a.width; x++) {
        auto i = std::size_t(y * a.width + x);
        auto value = [&](const image_data& image, const std::string& c) {
          return double(image.pixels[i * image.channels.size() + channel(image, c)]);
        };
        double d = value(a, name) - value(b, name);
        // error.V is the root mean square over channels: three times it bounds any one.
        double v = 3 * (std::pow(value(a, "error.V"), 2) + std::pow(value(b, "error.V"), 2));
        for (auto k : {std::size_t(y / 8 * columns + x / 8), means.size() - 1}) {
          means[k].difference += d;
          means[k].variance += v;
        }
      }
    for (const auto& m : means)
      worst = std::max(worst, std::abs(m.difference) / std::sqrt(m.variance + 1e-12));
  }
  return worst;
}

constexpr double limit = 5;

double against_reference(const std::string& name,
                         const std::function<void(scene_data&, trace_options&)>& change) {
  auto reference = load_image(std::string(WISP_TEST_PICTURES) + "/" + name + ".exr");
  return worst_difference(render(name, change), reference);
}

material_data& material_named(scene_data& scene, const std::string& name) {
  for (auto& m : scene.materials)
    if (m.name == name) return m;
  FAIL("no material " << name);
  return scene.materials[0];
}

}  // namespace

TEST_CASE("pictures: shipped scenes look as they did") {
  for (const auto& name : {"materials", "hair-ball"}) {
    CAPTURE(name);
    CHECK(against_reference(name, [](auto&, auto&) {}) < limit);
  }
}

TEST_CASE("pictures: a wrong renderer is noticed") {
  auto check = [](const std::string& what, const std::string& name,
                  const std::function<void(scene_data&, trace_options&)>& change) {
    CAPTURE(what);
    CHECK(against_reference(name, change) > limit);
  };
  check("lamps 5 % too bright", "materials",
        [](scene_data& s, trace_options&) { material_named(s, "lamp").emission *= 1.05f; });
  check("one event too few", "materials", [](scene_data&, trace_options& o) { o.bounces = 2; });
  check("clamped", "materials", [](scene_data&, trace_options& o) { o.clamp = 1; });
  check("roughness not squared", "materials", [](scene_data& s, trace_options&) {
    material_named(s, "reflective").roughness = std::sqrt(0.2f);
  });
  check("camera a pixel aside", "materials",
        [](scene_data& s, trace_options&) { s.cameras[0].frame[3].x += 0.02f; });
  auto hair = [](const std::function<void(hair_data&)>& change) {
    return [change](scene_data& s, trace_options&) {
      for (auto& m : s.materials) change(m.hair);
    };
  };
  check("tilt in radians", "hair-ball", hair([](hair_data& h) { h.alpha *= 57.3f; }));
  check("rougher along", "hair-ball", hair([](hair_data& h) { h.beta_m = 0.9f; }));
  check("rougher around", "hair-ball", hair([](hair_data& h) { h.beta_n = 0.8f; }));
  check("half the absorption", "hair-ball", hair([](hair_data& h) {
          h.eumelanin *= 0.5f;
          h.pheomelanin *= 0.5f;
          if (h.sigma_a) *h.sigma_a *= 0.5f;
          if (h.color) *h.color = glm::sqrt(*h.color);
        }));
}
