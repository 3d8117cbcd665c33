// A program that renders: a white matte triangle under a white sky of radiance 1
// sends back 1, wherever it is seen.

#include <cmath>
#include <cstdio>
#include <utility>

#include "wisp/render/image.h"
#include "wisp/render/render_scene.h"
#include "wisp/render/trace.h"

int main() {
  wisp::scene_data scene;
  wisp::camera_data camera;
  camera.frame[3] = {0, 0, 2};
  camera.aspect = 1;
  scene.cameras.push_back(camera);
  wisp::shape_data shape;
  shape.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
  shape.triangles = {{0, 1, 2}};
  scene.shapes.push_back(shape);
  wisp::material_data material;
  material.color = {1, 1, 1};
  scene.materials.push_back(material);
  wisp::instance_data instance;
  instance.shape = 0;
  instance.material = 0;
  scene.instances.push_back(instance);
  wisp::environment_data sky;
  sky.emission = {1, 1, 1};
  scene.environments.push_back(sky);

  wisp::warning_list warnings;
  auto prepared = wisp::prepare_scene(std::move(scene), {}, warnings);
  wisp::trace_options options;
  options.width = options.height = 16;
  options.samples = 64;
  auto state = wisp::make_trace_state(prepared, options);
  wisp::trace_image(state, prepared, options);
  auto image = wisp::get_image(state);

  auto channels = image.channels.size();
  double sum = 0, covered = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += channels) {
    sum += static_cast<double>(image.pixels[i]);
    covered += static_cast<double>(image.pixels[i + 3]);
  }
  double mean = sum * static_cast<double>(channels) / static_cast<double>(image.pixels.size());
  std::printf("mean %g, pixels covered %g\n", mean, covered);
  return std::abs(mean - 1) < 1e-3 && covered > 20 ? 0 : 1;
}
