// A unidirectional path tracer with next-event estimation and multiple
// importance sampling (Veach 1997, power heuristic). Deltas, boundaries of
// interiors and lights seen from inside an interior are left to scattered rays.

#include "path.h"

#include "hair_material.h"
#include "lights.h"
#include "wisp/hair/absorption.h"
#include "wisp/render/image.h"

namespace wisp {

namespace {

// Russian roulette: from the second scattering event on a path survives with
// probability min(1, 2 * throughput). Factor and start are those of the least
// time to a given error over hair of several colours.
constexpr int roulette_start = 1;
constexpr float roulette_factor = 2;
// A light sample that adds less than this part of the picture's brightness even
// if nothing is in the way is traced by chance, in proportion.
constexpr float light_roulette = 0.5f;
constexpr int max_pass_through = 256;  // surfaces that a path may slip through by opacity

float power_heuristic(float a, float b) {
  float r = b / a;
  return 1 / (1 + r * r);
}

// The interiors that a path is in, innermost last.
struct media_stack {
  std::array<material_point, 8> items = {};
  std::size_t count = 0;
  bool empty() const { return count == 0; }
  const material_point& top() const { return items[count - 1]; }
  void push(const material_point& m) {
    if (count < items.size()) items[count++] = m;
  }
  void pop() {
    if (count > 0) count--;
  }
};

vec3 hair_albedo(const render_scene& scene, const surface_point& p) {
  hair_look look;
  find_hair_look(scene, p, look, false);
  return hair::color_from_sigma_a(look.sigma_a, look.beta_n);
}

// The part of light that reaches along a ray: 0 or 1, or what opacity leaves.
float visibility(const render_scene& scene, ray3 ray) {
  if (!scene.has_transparency) return scene.accel->occluded(ray) ? 0.0f : 1.0f;
  float left = 1;
  for (int i = 0; i < max_pass_through; i++) {
    ray_hit hit;
    if (!scene.accel->intersect(ray, hit)) return left;
    surface_point p = eval_surface(scene, ray, hit);
    left *= 1 - eval_material(scene, p).opacity;
    if (left <= 0) return 0;
    float travelled = glm::distance(ray.o, p.position);
    ray3 next = spawn_ray(p, ray.d, ray.d, ray.tmax - travelled);
    if (next.tmax <= next.tmin) return left;
    ray = next;
  }
  return 0;
}

struct path_state {
  float brightness = 0;
  vec3 radiance = {0, 0, 0};
  vec3 weight = {1, 1, 1};
  // The last vertex that sampled lights, for the weights of lights that are hit.
  vec3 position = {0, 0, 0};
  float pdf = 0;  // of the scattered ray; 0: lights count in full
  // Radiance is 1 / ior^2 smaller inside of a solid than it will be again outside:
  // what roulette must not take for a loss.
  float refraction = 1;
};

void add_environments(const render_scene& scene, const vec3& direction, path_state& path) {
  for (std::size_t i = 0; i < scene.scene.environments.size(); i++) {
    vec3 emission = eval_environment(scene.scene, scene.scene.environments[i], direction);
    float mis = 1;
    if (path.pdf > 0) {
      float light = environment_light_pdf(scene, path.position, static_cast<int>(i), direction);
      mis = power_heuristic(path.pdf, light);
    }
    path.radiance += path.weight * emission * mis;
  }
}

void add_emission(const render_scene& scene, const surface_point& p, const vec3& emission,
                  path_state& path) {
  float mis = 1;
  if (path.pdf > 0) mis = power_heuristic(path.pdf, area_light_pdf(scene, path.position, p));
  path.radiance += path.weight * emission * mis;
}

// The side from which a ray leaves: that of the viewer where nothing passes
// through, even if smoothed normals send the ray below the face. It then meets
// the face again instead of leaking inside.
const vec3& side_of(const render_scene& scene, const surface_point& p, const vec3& outgoing,
                    const vec3& direction) {
  auto type = scene.scene.materials[static_cast<std::size_t>(p.material)].type;
  return is_transmissive(type) || type == material_type::transparent ? direction : outgoing;
}

// Next-event estimation: scatter(direction) gives value and pdf.
template <typename Scatter>
void add_light_sample(const render_scene& scene, const surface_point& p, const vec3& outgoing,
                      const vec4& u, path_state& path, Scatter&& scatter) {
  light_sample light = sample_light(scene, p.position, u);
  if (light.pdf <= 0 || light.radiance == vec3{0, 0, 0}) return;
  hair::hair_value<float> f = scatter(light.direction);
  if (f.value == vec3{0, 0, 0}) return;
  vec3 c = path.weight * f.value * light.radiance / light.pdf;
  if (!light.delta) c *= power_heuristic(light.pdf, f.pdf);
  float most = max_component(c), q = light_roulette * path.brightness;
  if (most <= 0) return;
  if (most < q) {
    if (u.w * q >= most) return;
    c *= q / most;
  }
  path.radiance += c * visibility(scene, spawn_ray(p, light.direction,
                                                   side_of(scene, p, outgoing, light.direction),
                                                   light.distance));
}

void record_first_hit(const render_scene& scene, const surface_point& p, const ray3& ray,
                      const vec3& albedo, first_hit& first) {
  first.found = true;
  first.albedo =
      scene.scene.materials[static_cast<std::size_t>(p.material)].type == material_type::hair
          ? hair_albedo(scene, p)
          : albedo;
  first.normal = p.normal;
  first.tangent = p.tangent;
  first.depth = glm::dot(p.position - ray.o, ray.d);
}

// Scatters at a strand of hair; false ends the path.
bool scatter_hair(const render_scene& scene, const surface_point& p, const vec4& u_bsdf,
                  const vec4& u_light, path_state& path, ray3& ray) {
  vec3 outgoing = -ray.d;
  // The fibre's frame: x along, y across (h > 0), z to the viewer.
  mat3 frame(p.tangent, p.across, glm::cross(p.tangent, p.across));
  mat3 to_local = glm::transpose(frame);
  hair_look look;
  find_hair_look(scene, p, look);
  const hair::hair_bsdf<float>& bsdf = *look.bsdf;
  // Lobes are drawn by what they add to this path.
  auto hit = hair::make_hair_hit<float>(bsdf, look.sigma_a, p.h, to_local * outgoing, path.weight);
  if (!scene.lights->sources.empty())
    add_light_sample(scene, p, outgoing, u_light, path, [&](const vec3& direction) {
      return hair::eval_hair_with_pdf<float>(bsdf, hit, to_local * direction);
    });
  auto wi = hair::sample_hair_with_pdf<float>(bsdf, hit, u_bsdf);
  if (!(wi.pdf > 0)) return false;
  path.weight *= wi.value / wi.pdf;
  path.pdf = scene.lights->sources.empty() ? 0 : wi.pdf;
  path.position = p.position;
  vec3 incoming = glm::normalize(frame * wi.direction);
  ray = spawn_ray(p, incoming, incoming);
  return true;
}

bool scatter_surface(const render_scene& scene, const surface_point& p, const material_point& m,
                     const vec4& u_bsdf, const vec4& u_light, media_stack& media, path_state& path,
                     ray3& ray) {
  vec3 outgoing = -ray.d;
  bool volumetric = is_volumetric(m);
  vec3 incoming;
  if (is_delta(m)) {
    incoming = sample_delta(m, p.normal, outgoing, u_bsdf.x);
    if (incoming == vec3{0, 0, 0}) return false;
    float pdf = sample_delta_pdf(m, p.normal, outgoing, incoming);
    if (!(pdf > 0)) return false;
    path.weight *= eval_delta(m, p.normal, outgoing, incoming) / pdf;
    path.pdf = 0;
  } else {
    auto crosses = [&](const vec3& direction) {
      return glm::dot(p.normal, outgoing) * glm::dot(p.normal, direction) < 0;
    };
    bool sample_lights = media.empty() && !scene.lights->sources.empty();
    if (sample_lights)
      add_light_sample(scene, p, outgoing, u_light, path, [&](const vec3& direction) {
        hair::hair_value<float> f;
        if (volumetric && crosses(direction)) return f;
        f.value = eval_bsdf(m, p.normal, outgoing, direction);
        f.pdf = sample_bsdf_pdf(m, p.normal, outgoing, direction);
        return f;
      });
    incoming = sample_bsdf(m, p.normal, outgoing, u_bsdf.x, {u_bsdf.y, u_bsdf.z});
    if (incoming == vec3{0, 0, 0}) return false;
    float pdf = sample_bsdf_pdf(m, p.normal, outgoing, incoming);
    if (!(pdf > 0)) return false;
    path.weight *= eval_bsdf(m, p.normal, outgoing, incoming) / pdf;
    path.pdf = sample_lights && !(volumetric && crosses(incoming)) ? pdf : 0;
    path.position = p.position;
  }
  if (glm::dot(p.normal, outgoing) * glm::dot(p.normal, incoming) < 0) {
    bool enters = glm::dot(p.normal, incoming) < 0;
    if (volumetric && enters) media.push(m);
    if (volumetric && !enters) media.pop();
    if (m.type == material_type::refractive || m.type == material_type::subsurface)
      path.refraction *= enters ? m.ior * m.ior : 1 / (m.ior * m.ior);
  }
  ray = spawn_ray(p, incoming, side_of(scene, p, outgoing, incoming));
  return true;
}

// Free flight through an interior up to distance t; true if it scattered there.
bool scatter_medium(const material_point& medium, float t, const vec4& u, const vec2& u_direction,
                    path_state& path, ray3& ray) {
  float distance = sample_transmittance(medium.density, t, u.z, u.w);
  float pdf = sample_transmittance_pdf(medium.density, distance, t);
  if (!(pdf > 0)) {
    path.weight = {0, 0, 0};
    return true;
  }
  path.weight *= eval_transmittance(medium.density, distance) / pdf;
  if (distance >= t) return false;
  vec3 outgoing = -ray.d;
  vec3 incoming = sample_scattering(medium, outgoing, u_direction);
  float phase = sample_scattering_pdf(medium, outgoing, incoming);
  path.weight *= phase > 0 ? eval_scattering(medium, outgoing, incoming) / phase : vec3{0, 0, 0};
  path.pdf = 0;
  ray = {ray.o + ray.d * distance, incoming, 0, infinity};
  return true;
}

// Russian roulette by throughput.
bool survives(path_state& path, int bounce, float u) {
  float q = roulette_factor * max_component(path.weight) * path.refraction;
  if (!(q > 0)) return false;
  if (bounce <= roulette_start || q >= 1) return true;
  path.weight /= q;
  return u < q;
}

}  // namespace

path_result trace_path(const render_scene& scene, ray3 ray, const sample_state& sampler,
                       const trace_options& options, float brightness, first_hit* first) {
  path_state path;
  path.brightness = brightness;
  path_result result;
  media_stack media;
  int passed = 0;
  int bounce = 0;
  for (uint32_t step = 0;; step++) {
    ray_hit hit;
    bool found = scene.accel->intersect(ray, hit);
    vec4 u_misc = {};
    bool misc_drawn = false;
    auto misc = [&]() -> const vec4& {
      if (!misc_drawn) u_misc = sample_4d(sampler, 3 * step + 3);
      misc_drawn = true;
      return u_misc;
    };

    if (!media.empty()) {
      if (!found) break;  // an open interior has no far side
      vec4 u = sample_4d(sampler, 3 * step + 1);
      if (scatter_medium(media.top(), hit.t, misc(), {u.y, u.z}, path, ray)) {
        if (++bounce > options.bounces) break;
        if (!survives(path, bounce, misc().y)) break;
        continue;
      }
    }
    if (!found) {
      if (bounce > 0 || !options.hide_environment) {
        add_environments(scene, ray.d, path);
        result.covered = result.covered || !scene.scene.environments.empty();
      }
      break;
    }
    surface_point p = eval_surface(scene, ray, hit);
    const auto& material = scene.scene.materials[static_cast<std::size_t>(p.material)];
    bool is_hair = material.type == material_type::hair && p.kind == element_kind::strand;
    material_point m;
    if (!is_hair || scene.has_transparency || material.emission != vec3{0, 0, 0} || first)
      m = eval_material(scene, p);
    if (m.type == material_type::hair && !is_hair) m.type = material_type::matte;  // faces, points
    if (m.opacity < 1 && misc().x >= m.opacity) {
      if (++passed > max_pass_through) break;
      ray = spawn_ray(p, ray.d, ray.d);
      continue;
    }
    result.covered = true;
    if (first && !first->found)
      record_first_hit(scene, p, ray, p.unlit ? m.emission : m.color, *first);
    if (m.emission != vec3{0, 0, 0}) add_emission(scene, p, m.emission, path);
    if (p.unlit || bounce >= options.bounces) break;
    bounce++;

    vec4 u_bsdf = sample_4d(sampler, 3 * step + 1);
    vec4 u_light = scene.lights->sources.empty() ? vec4{} : sample_4d(sampler, 3 * step + 2);
    bool alive = is_hair ? scatter_hair(scene, p, u_bsdf, u_light, path, ray)
                         : scatter_surface(scene, p, m, u_bsdf, u_light, media, path, ray);
    if (!alive) break;

    if (!survives(path, bounce, misc().y)) break;
  }
  result.radiance = path.radiance;
  if (options.clamp > 0 && max_component(result.radiance) > options.clamp)
    result.radiance *= options.clamp / max_component(result.radiance);
  return result;
}

}  // namespace wisp
