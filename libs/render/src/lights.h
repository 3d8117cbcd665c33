#pragma once

// Where light comes from, and how a point samples it.

#include <vector>

#include "surface.h"
#include "wisp/core/report.h"
#include "wisp/core/sampling.h"

namespace wisp {

// Something that next-event estimation can aim at.
struct light_source {
  enum struct kind { area, environment, punctual } type = kind::area;
  int index = invalid_id;  // instance, environment or light
  float power = 0;         // luminance: radiance times area, radiance, or intensity
  vec3 center = {0, 0, 0};
  float size2 = 0;                      // squared half diagonal of an area light
  float area = 0;                       // world area
  discrete_distribution elements = {};  // area: triangles by area
  std::vector<ivec3> triangles = {};    // area: quads split
  distribution_2d map = {};             // environment: by luminance and solid angle
};

struct light_sampler {
  std::vector<light_source> sources = {};
  discrete_distribution by_power = {};  // used above max_spatial sources
  std::vector<int> source_of_instance = {};
  std::vector<int> source_of_environment = {};

  static constexpr std::size_t max_spatial = 16;
};

light_sampler make_lights(const scene_data& scene, std::vector<part_report>& parts, bool plan_only);

struct light_sample {
  vec3 direction = {0, 0, 0};
  float distance = infinity;
  vec3 radiance = {0, 0, 0};  // divided by nothing; for punctual lights the irradiance
  float pdf = 0;              // by solid angle, with the choice of light; punctual: of the choice
  bool delta = false;         // cannot be hit by a scattered ray
};

// u.x picks the light, u.y and u.z a point on it.
light_sample sample_light(const render_scene& scene, const vec3& position, const vec4& u);
// The density with which sample_light at `position` draws the direction to a
// point on an instance, or to an environment.
float area_light_pdf(const render_scene& scene, const vec3& position, const surface_point& target);
float environment_light_pdf(const render_scene& scene, const vec3& position, int environment,
                            const vec3& direction);

vec3 eval_environment(const scene_data& scene, const environment_data& environment,
                      const vec3& direction);

}  // namespace wisp
