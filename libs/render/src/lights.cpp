#include "lights.h"

#include <fmt/format.h>

#include <chrono>

#include "wisp/geometry/mesh.h"
#include "wisp/render/image.h"

namespace wisp {

namespace {

float max_value(const vec3& v) { return max_component(v); }

// Texture coordinate of a direction in an environment, and the sine of its
// polar angle.
vec2 environment_texcoord(const environment_data& environment, const vec3& direction, float* sine) {
  vec3 local = {glm::dot(environment.frame[0], direction),
                glm::dot(environment.frame[1], direction),
                glm::dot(environment.frame[2], direction)};
  float across = std::sqrt(local.x * local.x + local.z * local.z);
  if (sine) *sine = across;
  float u = std::atan2(local.z, local.x) / (2 * pi);
  return {u < 0 ? u + 1 : u, std::atan2(across, local.y) / pi};
}

const texture_data* environment_texture(const scene_data& scene, const environment_data& e) {
  return e.emission_tex == invalid_id ? nullptr
                                      : &scene.textures[static_cast<std::size_t>(e.emission_tex)];
}

// Luminance by texel, times the solid angle of its row; and how uneven it is.
std::vector<float> environment_weights(const texture_data& texture, float& mean, float& peak) {
  auto w = static_cast<std::size_t>(texture.width), h = static_cast<std::size_t>(texture.height);
  std::vector<float> weights(w * h);
  double sum = 0, area = 0;
  peak = 0;
  for (std::size_t j = 0; j < h; j++) {
    float sine = std::sin(pi * (static_cast<float>(j) + 0.5f) / static_cast<float>(h));
    for (std::size_t i = 0; i < w; i++) {
      // The interpolated texture in a cell is bounded by its neighbours too: at
      // the cell's centre and corners.
      vec2 uv = {(static_cast<float>(i) + 0.5f) / static_cast<float>(w),
                 (static_cast<float>(j) + 0.5f) / static_cast<float>(h)};
      float l = luminance(vec3(eval_texture(texture, uv, false)));
      if (!(l >= 0) || !std::isfinite(l)) l = 0;
      weights[j * w + i] = l * sine;
      sum += static_cast<double>(l) * static_cast<double>(sine);
      area += static_cast<double>(sine);
      peak = std::max(peak, l);
    }
  }
  mean = static_cast<float>(sum / area);
  return weights;
}

// A cell next to a bright one is not dark once the texture is interpolated: each
// gets a part of the largest of its neighbours, so that no density is far too low.
std::vector<float> spread(const std::vector<float>& weights, std::size_t w, std::size_t h) {
  std::vector<float> out(weights.size());
  for (std::size_t j = 0; j < h; j++)
    for (std::size_t i = 0; i < w; i++) {
      float around = 0;
      for (std::size_t y = j > 0 ? j - 1 : 0; y <= std::min(j + 1, h - 1); y++)
        for (std::size_t k = 0; k < 3; k++)
          around = std::max(around, weights[y * w + (i + w + k - 1) % w]);
      out[j * w + i] = 0.75f * weights[j * w + i] + 0.25f * around;
    }
  return out;
}

bool make_area(const scene_data& scene, std::size_t instance_id, light_source& source) {
  const auto& instance = scene.instances[instance_id];
  const auto& material = scene.materials[static_cast<std::size_t>(instance.material)];
  const auto& shape = scene.shapes[static_cast<std::size_t>(instance.shape)];
  if (max_value(material.emission) <= 0 || shape.paint.unlit) return false;
  if (shape.triangles.empty() && shape.quads.empty()) return false;
  source.type = light_source::kind::area;
  source.index = static_cast<int>(instance_id);
  source.triangles = shape.triangles;
  auto split = quads_to_triangles(shape.quads);
  source.triangles.insert(source.triangles.end(), split.begin(), split.end());
  std::vector<float> areas(source.triangles.size());
  vec3 low = vec3(infinity), high = vec3(-infinity);
  double area = 0;
  for (std::size_t i = 0; i < areas.size(); i++) {
    std::array<vec3, 3> p;
    for (int k = 0; k < 3; k++) {
      p[static_cast<std::size_t>(k)] = transform_point(
          instance.frame, shape.positions[static_cast<std::size_t>(source.triangles[i][k])]);
      low = glm::min(low, p[static_cast<std::size_t>(k)]);
      high = glm::max(high, p[static_cast<std::size_t>(k)]);
    }
    areas[i] = triangle_area(p[0], p[1], p[2]);
    area += static_cast<double>(areas[i]);
  }
  source.elements = make_discrete(areas);
  if (source.elements.cdf.empty()) return false;
  source.area = static_cast<float>(area);
  source.power = luminance(material.emission) * source.area;
  source.center = (low + high) * 0.5f;
  source.size2 = glm::dot(high - low, high - low) / 4;
  return true;
}

// How much a source may give at a point, without visibility or cosines.
float source_weight(const light_source& s, const vec3& position) {
  if (s.type == light_source::kind::environment) return s.power * 2 * pi;
  vec3 d = s.center - position;
  float d2 = std::max(glm::dot(d, d), s.size2);
  if (s.size2 == infinity) return s.power;  // directional
  return d2 > 0 ? s.power / d2 : s.power;
}

// Chooses among few sources by what they may give here, among many by power.
// Returns the index; *probability is that of the choice.
int choose_source(const light_sampler& lights, const vec3& position, float u, float* probability) {
  std::size_t n = lights.sources.size();
  if (n == 1) {
    *probability = 1;
    return 0;
  }
  if (n > light_sampler::max_spatial) {
    int i = sample_discrete(lights.by_power, u);
    *probability = discrete_pdf(lights.by_power, i);
    return i;
  }
  std::array<float, light_sampler::max_spatial> weights;
  float sum = 0;
  for (std::size_t i = 0; i < n; i++)
    sum += weights[i] = source_weight(lights.sources[i], position);
  float target = u * sum;
  std::size_t last = 0;
  for (std::size_t i = 0; i < n; i++) {
    if (weights[i] <= 0) continue;
    last = i;
    if (target < weights[i]) break;
    target -= weights[i];
  }
  *probability = sum > 0 ? weights[last] / sum : 0;
  return static_cast<int>(last);
}

float choice_probability(const light_sampler& lights, const vec3& position, int source) {
  std::size_t n = lights.sources.size();
  if (n == 1) return 1;
  if (n > light_sampler::max_spatial) return discrete_pdf(lights.by_power, source);
  float sum = 0, own = 0;
  for (std::size_t i = 0; i < n; i++) {
    float w = source_weight(lights.sources[i], position);
    sum += w;
    if (static_cast<int>(i) == source) own = w;
  }
  return sum > 0 ? own / sum : 0;
}

light_sample sample_punctual(const light_data& light, const vec3& position) {
  light_sample s;
  s.delta = true;
  if (light.type == light_type::directional) {
    s.direction = normalize_or_zero(light.frame[2]);
    s.radiance = light.intensity;
    return s;
  }
  vec3 d = light.frame[3] - position;
  s.distance = glm::length(d);
  if (s.distance == 0 || s.distance > light.range) return s;
  s.direction = d / s.distance;
  s.radiance = light.intensity / (s.distance * s.distance);
  if (light.type == light_type::spot) {
    // The cone's edge of KHR_lights_punctual.
    float c = glm::dot(s.direction, normalize_or_zero(light.frame[2]));
    float outer = std::cos(light.outer_cone), inner = std::cos(light.inner_cone);
    float a = std::clamp((c - outer) / std::max(0.001f, inner - outer), 0.0f, 1.0f);
    s.radiance *= a * a;
  }
  return s;
}

}  // namespace

vec3 eval_environment(const scene_data& scene, const environment_data& environment,
                      const vec3& direction) {
  const texture_data* texture = environment_texture(scene, environment);
  if (!texture) return environment.emission;
  return environment.emission *
         vec3(eval_texture(*texture, environment_texcoord(environment, direction, nullptr), false));
}

light_sampler make_lights(const scene_data& scene, std::vector<part_report>& parts,
                          bool plan_only) {
  auto now = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  };
  light_sampler lights;
  double start = now();
  std::size_t bytes = 0, triangles = 0, area_lights = 0;
  lights.source_of_instance.assign(scene.instances.size(), -1);
  for (std::size_t i = 0; i < scene.instances.size(); i++) {
    light_source source;
    if (!make_area(scene, i, source)) continue;
    lights.source_of_instance[i] = static_cast<int>(lights.sources.size());
    area_lights++;
    triangles += source.triangles.size();
    bytes += source.triangles.size() * sizeof(ivec3) + source.elements.cdf.size() * sizeof(float);
    lights.sources.push_back(std::move(source));
  }
  std::size_t punctual = 0;
  for (std::size_t i = 0; i < scene.lights.size(); i++) {
    const auto& light = scene.lights[i];
    if (max_value(light.intensity) <= 0) continue;
    light_source source;
    source.type = light_source::kind::punctual;
    source.index = static_cast<int>(i);
    source.power = luminance(light.intensity);
    source.center = light.frame[3];
    source.size2 = light.type == light_type::directional ? infinity : 0;
    lights.sources.push_back(std::move(source));
    punctual++;
  }
  parts.push_back({"light sampler", area_lights + punctual > 0,
                   area_lights + punctual > 0
                       ? fmt::format("{} area lights of {} triangles, {} lights without extent",
                                     area_lights, triangles, punctual)
                       : "nothing in the scene emits",
                   now() - start, bytes});

  start = now();
  bytes = 0;
  std::string why = scene.environments.empty() ? "no environment" : "";
  bool built = false;
  lights.source_of_environment.assign(scene.environments.size(), -1);
  for (std::size_t i = 0; i < scene.environments.size(); i++) {
    const auto& environment = scene.environments[i];
    if (max_value(environment.emission) <= 0) {
      why = "the environment is black";
      continue;
    }
    const texture_data* texture = environment_texture(scene, environment);
    if (!texture) {
      why = "the environment is constant: scattered rays find it";
      continue;
    }
    built = true;
    why = "the environment is an image";
    if (plan_only) continue;
    light_source source;
    float mean = 0, peak = 0;
    auto weights = environment_weights(*texture, mean, peak);
    if (peak <= 0) {
      built = false;
      why = "the environment is black";
      continue;
    }
    if (peak < 2 * mean) {
      built = false;
      why = "the environment is nearly constant: scattered rays find it";
      continue;
    }
    source.type = light_source::kind::environment;
    source.index = static_cast<int>(i);
    source.power = mean * luminance(environment.emission);
    source.map = make_distribution_2d(spread(weights, static_cast<std::size_t>(texture->width),
                                             static_cast<std::size_t>(texture->height)),
                                      texture->width, texture->height);
    bytes += (source.map.cells.size() + source.map.rows.size()) * sizeof(float);
    lights.source_of_environment[i] = static_cast<int>(lights.sources.size());
    lights.sources.push_back(std::move(source));
  }
  parts.push_back({"environment sampler", built, why, now() - start, bytes});

  if (lights.sources.size() > light_sampler::max_spatial) {
    std::vector<float> power;
    for (const auto& s : lights.sources) power.push_back(s.power);
    lights.by_power = make_discrete(power);
  }
  return lights;
}

light_sample sample_light(const render_scene& scene, const vec3& position, const vec4& u) {
  light_sample s;
  const light_sampler& lights = *scene.lights;
  if (lights.sources.empty()) return s;
  float probability = 0;
  int chosen = choose_source(lights, position, u.x, &probability);
  if (chosen < 0 || probability <= 0) return s;
  const light_source& source = lights.sources[static_cast<std::size_t>(chosen)];
  auto index = static_cast<std::size_t>(source.index);

  if (source.type == light_source::kind::punctual) {
    s = sample_punctual(scene.scene.lights[index], position);
    s.pdf = probability;
    return s;
  }
  if (source.type == light_source::kind::environment) {
    const auto& environment = scene.scene.environments[index];
    vec2 uv = sample_2d(source.map, {u.y, u.z});
    float theta = uv.y * pi, phi = uv.x * 2 * pi;
    float sine = std::sin(theta);
    if (sine <= 0) return s;
    vec3 local = {std::cos(phi) * sine, std::cos(theta), std::sin(phi) * sine};
    s.direction = transform_vector(environment.frame, local);
    s.pdf = probability * distribution_pdf(source.map, uv) / (2 * pi * pi * sine);
    s.radiance = eval_environment(scene.scene, environment, s.direction);
    return s;
  }
  const auto& instance = scene.scene.instances[index];
  const auto& shape = scene.scene.shapes[static_cast<std::size_t>(instance.shape)];
  float rest = 0;
  int element = sample_discrete(source.elements, u.y, &rest);
  ivec3 t = source.triangles[static_cast<std::size_t>(element)];
  vec2 uv = sample_triangle({rest, u.z});
  auto corner = [&](int k) { return static_cast<std::size_t>(t[k]); };
  vec3 a = transform_point(instance.frame, shape.positions[corner(0)]);
  vec3 b = transform_point(instance.frame, shape.positions[corner(1)]);
  vec3 c = transform_point(instance.frame, shape.positions[corner(2)]);
  vec3 point = a + (b - a) * uv.x + (c - a) * uv.y;
  vec3 normal = triangle_normal(a, b, c);
  vec3 d = point - position;
  float d2 = glm::dot(d, d);
  if (d2 <= 0 || !std::isfinite(d2)) return s;
  s.distance = std::sqrt(d2);
  s.direction = d / s.distance;
  float cosine = std::abs(glm::dot(normal, s.direction));
  if (cosine < 1e-6f) return s;
  s.pdf = probability * d2 / (cosine * source.area);
  s.distance *= 0.9999f;

  const auto& material = scene.scene.materials[static_cast<std::size_t>(instance.material)];
  s.radiance = material.emission;
  if (material.emission_tex != invalid_id && !shape.texcoords.empty()) {
    vec2 st = shape.texcoords[corner(0)] * (1 - uv.x - uv.y) + shape.texcoords[corner(1)] * uv.x +
              shape.texcoords[corner(2)] * uv.y;
    s.radiance *= vec3(eval_texture(
        scene.scene.textures[static_cast<std::size_t>(material.emission_tex)], st, false));
  }
  return s;
}

float area_light_pdf(const render_scene& scene, const vec3& position, const surface_point& target) {
  const light_sampler& lights = *scene.lights;
  int index = lights.source_of_instance[static_cast<std::size_t>(target.instance)];
  if (index < 0 || target.kind == element_kind::strand || target.kind == element_kind::point ||
      target.kind == element_kind::solid)
    return 0;
  const light_source& source = lights.sources[static_cast<std::size_t>(index)];
  vec3 d = target.position - position;
  float d2 = glm::dot(d, d);
  if (d2 <= 0) return 0;
  float cosine = std::abs(glm::dot(target.geometric_normal, d)) / std::sqrt(d2);
  if (cosine < 1e-6f) return 0;
  return choice_probability(lights, position, index) * d2 / (cosine * source.area);
}

float environment_light_pdf(const render_scene& scene, const vec3& position, int environment,
                            const vec3& direction) {
  const light_sampler& lights = *scene.lights;
  int index = lights.source_of_environment[static_cast<std::size_t>(environment)];
  if (index < 0) return 0;
  float sine = 0;
  vec2 uv = environment_texcoord(scene.scene.environments[static_cast<std::size_t>(environment)],
                                 direction, &sine);
  if (sine <= 0) return 0;
  return choice_probability(lights, position, index) *
         distribution_pdf(lights.sources[static_cast<std::size_t>(index)].map, uv) /
         (2 * pi * pi * sine);
}

}  // namespace wisp
