#include "wisp/render/render_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "accel.h"
#include "hair_material.h"
#include "lights.h"
#include "wisp/core/memory.h"
#include "wisp/render/image.h"
#include "wisp/render/tesselate.h"
#include "wisp/scene/solid.h"

namespace wisp {

render_scene::render_scene() = default;
render_scene::~render_scene() = default;
render_scene::render_scene(render_scene&&) noexcept = default;
render_scene& render_scene::operator=(render_scene&&) noexcept = default;

namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::size_t at(int i) { return static_cast<std::size_t>(i); }

void check_indices(const scene_data& scene) {
  auto fail = [](const std::string& what) { throw std::invalid_argument(what); };
  auto check = [&](int index, std::size_t count, const char* owner, std::size_t i,
                   const char* what) {
    if (index < 0 || at(index) >= count)
      fail(fmt::format("{} {} refers to {} {}, but there are {}", owner, i, what, index, count));
  };
  auto check_texture = [&](int index, const char* owner, std::size_t i) {
    if (index != invalid_id) check(index, scene.textures.size(), owner, i, "texture");
  };
  for (std::size_t i = 0; i < scene.instances.size(); i++) {
    if (scene.instances[i].shape == invalid_id && scene.instances[i].section != invalid_id)
      fail(
          fmt::format("instance {} shows a section, which is to be solved and replaced by shapes "
                      "before the scene is rendered",
                      i));
    check(scene.instances[i].shape, scene.shapes.size(), "instance", i, "shape");
    check(scene.instances[i].material, scene.materials.size(), "instance", i, "material");
  }
  for (std::size_t i = 0; i < scene.shapes.size(); i++)
    if (scene.shapes[i].solid != invalid_id)
      check(scene.shapes[i].solid, scene.solids.size(), "shape", i, "solid");
  for (std::size_t i = 0; i < scene.materials.size(); i++) {
    const auto& m = scene.materials[i];
    for (int t : {m.emission_tex, m.color_tex, m.roughness_tex, m.scattering_tex, m.normal_tex,
                  m.sigma_a_tex})
      check_texture(t, "material", i);
  }
  for (std::size_t i = 0; i < scene.environments.size(); i++)
    check_texture(scene.environments[i].emission_tex, "environment", i);
  for (std::size_t i = 0; i < scene.subdivs.size(); i++) {
    check_texture(scene.subdivs[i].displacement_tex, "subdiv", i);
    check(scene.subdivs[i].shape, scene.shapes.size(), "subdiv", i, "shape");
  }
}

std::vector<bool> displacement_textures(const scene_data& scene) {
  std::vector<bool> used(scene.textures.size(), false);
  for (const auto& subdiv : scene.subdivs)
    if (subdiv.displacement_tex != invalid_id && subdiv.displacement != 0)
      used[at(subdiv.displacement_tex)] = true;
  return used;
}

// Textures that something that is seen or shines refers to.
std::vector<bool> shading_textures(const scene_data& scene) {
  std::vector<bool> used(scene.textures.size(), false);
  auto mark = [&](int t) {
    if (t != invalid_id) used[at(t)] = true;
  };
  for (const auto& instance : scene.instances) {
    const auto& m = scene.materials[at(instance.material)];
    if (m.emission != vec3{0, 0, 0}) mark(m.emission_tex);
    mark(m.color_tex);
    mark(m.roughness_tex);
    if (m.type == material_type::hair) {
      mark(m.sigma_a_tex);
      continue;
    }
    mark(m.scattering_tex);
    mark(m.normal_tex);
  }
  for (const auto& environment : scene.environments)
    if (environment.emission != vec3{0, 0, 0}) mark(environment.emission_tex);
  return used;
}

part_report texture_part(const scene_data& scene, const std::vector<bool>& used) {
  auto count = std::count(used.begin(), used.end(), true);
  part_report part{"textures", count > 0, "", 0, 0};
  if (count > 0)
    part.why = fmt::format("{} of {} are used", count, scene.textures.size());
  else
    part.why = scene.textures.empty() ? "no textures in the scene" : "no texture is used";
  return part;
}

// OpenImageIO is loaded when an image is read.
part_report image_part(const std::vector<bool>& used) {
  bool read = std::find(used.begin(), used.end(), true) != used.end();
  return {"image library", read, read ? "textures are read" : "no texture is read", 0, 0};
}

// What plan_parts says of solids without building them.
void plan_solids(const scene_data& scene, std::vector<part_report>& parts) {
  std::vector<bool> shown(scene.shapes.size(), false);
  for (const auto& instance : scene.instances) shown[at(instance.shape)] = true;
  std::size_t meshes = 0, meshed = 0;
  for (std::size_t i = 0; i < scene.shapes.size(); i++) {
    if (!shown[i] || scene.shapes[i].solid == invalid_id) continue;
    const solid_data& solid = scene.solids[at(scene.shapes[i].solid)];
    meshed += solid.display == solid_display::mesh;
    for (const auto& node : solid.nodes) meshes += node.type == solid_type::mesh;
  }
  const char* none = "no solid that is shown has a mesh";
  parts.push_back({"distance tree", meshes > 0,
                   meshes > 0 ? fmt::format("{} meshes in solids", meshes) : none, 0, 0});
  parts.push_back({"winding numbers", meshes > 0,
                   meshes > 0 ? "only where a mesh in a solid is open" : none, 0, 0});
  parts.push_back({"solid meshes", meshed > 0,
                   meshed > 0 ? fmt::format("{} solids", meshed) : "no solid is shown as a mesh", 0,
                   0});
}

part_report subdiv_part(const scene_data& scene) {
  return {"subdivision", !scene.subdivs.empty(),
          scene.subdivs.empty() ? "no subdivs in the scene"
                                : fmt::format("{} subdivs", scene.subdivs.size()),
          0, 0};
}

// The solids that instances show: meshed in their shapes, or to be traced.
std::vector<traced_solid> make_solids(scene_data& scene, int threads,
                                      std::vector<part_report>& parts, warning_list& warnings) {
  double start = now();
  solid_parts built;
  std::vector<traced_solid> traced(scene.shapes.size());
  std::vector<bool> shown(scene.shapes.size(), false);
  for (const auto& instance : scene.instances) shown[at(instance.shape)] = true;
  std::vector<std::pair<std::size_t, sdf>> meshed;
  bool any = false;
  for (std::size_t i = 0; i < scene.shapes.size(); i++) {
    if (!shown[i] || scene.shapes[i].solid == invalid_id) continue;
    const solid_data& solid = scene.solids[at(scene.shapes[i].solid)];
    sdf tree = make_sdf(scene, solid, threads, warnings, &built);
    if (solid.display == solid_display::trace) {
      const dbox3 bounds = properties(tree).bounds;
      if (is_empty(bounds) || !is_finite(bounds))
        throw std::invalid_argument("solid '" + solid.name +
                                    (is_empty(bounds) ? "' is empty"
                                                      : "' is infinite; intersect it with "
                                                        "something that is not"));
      traced[i] = {tree, solid.cuts};
      any = true;
    } else {
      std::vector<sdf> parts_of = {tree};
      for (const auto& cut : solid.cuts) parts_of.push_back(sdf_plane(cut.point, cut.normal));
      if (parts_of.size() > 1) tree = sdf_intersection(parts_of);
      meshed.emplace_back(i, tree);
    }
  }
  double trees = now() - start;
  parts.push_back({"distance tree", built.meshes > 0,
                   built.meshes > 0 ? fmt::format("{} meshes in solids", built.meshes)
                                    : "no solid that is shown has a mesh",
                   trees, built.tree_bytes});
  parts.push_back({"winding numbers", built.open_meshes > 0,
                   built.open_meshes > 0 ? fmt::format("{} meshes are open", built.open_meshes)
                   : built.meshes > 0    ? "the meshes are closed: crossings of a ray tell"
                                         : "no solid that is shown has a mesh",
                   0, built.winding_bytes});
  start = now();
  std::size_t triangles = 0, bytes = 0;
  for (auto& [i, tree] : meshed) {
    shape_data mesh = tesselate_solid(scene.solids[at(scene.shapes[i].solid)], tree, threads);
    mesh.solid = scene.shapes[i].solid;
    mesh.paint = scene.shapes[i].paint;
    triangles += mesh.triangles.size();
    bytes += mesh.triangles.size() * sizeof(ivec3) + mesh.positions.size() * 2 * sizeof(vec3);
    scene.shapes[i] = std::move(mesh);
  }
  parts.push_back({"solid meshes", !meshed.empty(),
                   !meshed.empty()
                       ? fmt::format("{} triangles of {} solids", triangles, meshed.size())
                       : "no solid is shown as a mesh",
                   now() - start, bytes});
  if (!any) traced.clear();
  return traced;
}

// Meshes that were there for solids alone.
void release_unused_shapes(scene_data& scene) {
  std::vector<bool> shown(scene.shapes.size(), false);
  for (const auto& instance : scene.instances) shown[at(instance.shape)] = true;
  for (std::size_t i = 0; i < scene.shapes.size(); i++)
    if (!shown[i]) {
      shape_data empty;
      empty.name = std::move(scene.shapes[i].name);
      scene.shapes[i] = std::move(empty);
    }
}

// A shape that is used once is moved to where its instance puts it, so that rays
// need no transform.
void bake_single_instances(scene_data& scene) {
  std::vector<int> uses(scene.shapes.size(), 0);
  for (const auto& instance : scene.instances) uses[at(instance.shape)]++;
  for (auto& instance : scene.instances) {
    if (uses[at(instance.shape)] != 1 || instance.frame == identity_frame) continue;
    if (keeps_space(scene, scene.shapes[at(instance.shape)])) continue;
    auto& shape = scene.shapes[at(instance.shape)];
    const frame3& f = instance.frame;
    float det = glm::determinant(rotation(f));
    for (auto& p : shape.positions) p = transform_point(f, p);
    for (auto& n : shape.normals) n = transform_normal(f, n);
    for (auto& t : shape.tangents) t = vec4(normalize_or_zero(transform_vector(f, vec3(t))), t.w);
    float scale = std::cbrt(std::abs(det));
    for (auto& r : shape.radius) r *= scale;
    if (det < 0) {  // keep the outside outside
      for (auto& t : shape.triangles) std::swap(t.y, t.z);
      for (auto& q : shape.quads)
        q = q.z == q.w ? ivec4{q.x, q.z, q.y, q.y} : ivec4{q.x, q.w, q.z, q.y};
    }
    instance.frame = identity_frame;
  }
}

bool texture_has_holes(const texture_data& t) {
  return std::any_of(t.pixelsb.begin(), t.pixelsb.end(),
                     [](const u8vec4& p) { return p.w < 255; }) ||
         std::any_of(t.pixelsf.begin(), t.pixelsf.end(), [](const vec4& p) { return p.w < 1; });
}

bool has_transparency(const scene_data& scene) {
  for (const auto& instance : scene.instances) {
    const auto& m = scene.materials[at(instance.material)];
    if (m.opacity < 1) return true;
    if (m.color_tex != invalid_id && texture_has_holes(scene.textures[at(m.color_tex)]))
      return true;
    if (scene.shapes[at(instance.shape)].paint.transparent) return true;
    const auto& colors = scene.shapes[at(instance.shape)].colors;
    if (std::any_of(colors.begin(), colors.end(), [](const vec4& c) { return c.w < 1; }))
      return true;
  }
  return false;
}

std::vector<uint32_t> count_copies(const scene_data& scene) {
  std::vector<uint32_t> result, seen(scene.shapes.size(), 0);
  for (const auto& use : find_strand_use(scene))
    if (use.index || use.along) {
      for (const auto& instance : scene.instances) result.push_back(seen[at(instance.shape)]++);
      break;
    }
  return result;
}

bool is_empty(const shape_data& s) {
  return s.solid == invalid_id && s.points.empty() && s.triangles.empty() && s.quads.empty() &&
         strand_count(s) == 0;
}

}  // namespace

std::vector<part_report> plan_parts(const scene_data& scene) {
  check_indices(scene);
  std::vector<part_report> parts;
  parts.push_back(subdiv_part(scene));
  plan_solids(scene, parts);
  auto used = shading_textures(scene);
  auto displaced = displacement_textures(scene);
  for (std::size_t i = 0; i < used.size(); i++) used[i] = used[i] || displaced[i];
  parts.push_back(texture_part(scene, used));
  parts.push_back(image_part(used));
  parts.push_back(hair_part(scene));
  element_use elements = count_elements(scene);
  for (const auto& subdiv : scene.subdivs)
    elements.quads += subdiv.quadspos.size() << (2 * std::clamp(subdiv.subdivisions, 0, 12));
  auto rays = [&](const char* name, const char* thing, std::size_t count) {
    parts.push_back(
        {name, count > 0,
         count > 0 ? fmt::format("{} {}", count, thing) : fmt::format("no {} in the scene", thing),
         0, 0});
  };
  rays("triangle rays", "triangles", elements.triangles);
  rays("quad rays", "quads", elements.quads);
  rays("curve rays", "curve segments", elements.strands);
  rays("point rays", "points", elements.points);
  rays("solid rays", "traced solids", elements.solids);
  parts.push_back({"instances", elements.instanced > 0,
                   elements.instanced > 0
                       ? fmt::format("{} instances share a shape", elements.instanced)
                       : "no shape is used twice",
                   0, 0});
  make_lights(scene, parts, true);
  return parts;
}

render_scene prepare_scene(scene_data&& scene, const prepare_options& options,
                           warning_list& warnings) {
  check_indices(scene);
  render_scene result;
  auto& parts = result.parts;

  double start = now();
  part_report part = subdiv_part(scene);
  auto displaced = displacement_textures(scene);
  std::size_t bytes = load_textures(scene, displaced, options.threads);
  tesselate_subdivs(scene);
  part.seconds = now() - start;
  parts.push_back(part);

  std::vector<traced_solid> solids = make_solids(scene, options.threads, parts, warnings);
  std::erase_if(scene.instances,
                [&](const instance_data& i) { return is_empty(scene.shapes[at(i.shape)]); });
  release_unused_shapes(scene);
  bool shines = !scene.lights.empty() ||
                std::any_of(scene.environments.begin(), scene.environments.end(),
                            [](const auto& e) { return max_component(e.emission) > 0; }) ||
                std::any_of(scene.instances.begin(), scene.instances.end(), [&](const auto& i) {
                  return max_component(scene.materials[at(i.material)].emission) > 0 ||
                         scene.shapes[at(i.shape)].paint.unlit;
                });
  if (scene.instances.empty() && !shines)
    throw std::invalid_argument(
        "nothing to render: no instance has a face, point or strand, and there is no environment");
  if (!shines)
    warnings.push_back(
        "no light: no environment, no emissive material on an instance and no light; the picture "
        "will be black");

  start = now();
  clamp_strand_textures(scene);
  displaced.resize(scene.textures.size(), false);
  auto used = shading_textures(scene);
  part = texture_part(scene, used);
  bytes += load_textures(scene, used, options.threads);
  part.seconds = now() - start;
  part.bytes = bytes;
  parts.push_back(part);
  for (std::size_t i = 0; i < used.size(); i++) displaced[i] = displaced[i] || used[i];
  parts.push_back(image_part(displaced));
  for (std::size_t i = 0; i < used.size(); i++)  // displacement has done its work
    if (!used[i]) release(scene.textures[i].pixelsf), release(scene.textures[i].pixelsb);

  start = now();
  part = hair_part(scene);
  if (part.built)
    for (const auto& material : scene.materials)
      result.hair.push_back(make_hair_material(material));
  part.seconds = now() - start;
  part.bytes = result.hair.size() * sizeof(hair_material);
  parts.push_back(part);

  result.copies = count_copies(scene);
  result.has_transparency = has_transparency(scene);
  bake_single_instances(scene);
  result.lights = std::make_unique<light_sampler>();
  std::vector<part_report> light_parts;
  *result.lights = make_lights(scene, light_parts, false);
  result.scene = std::move(scene);
  result.accel = std::make_unique<ray_accel>(result.scene, std::move(solids), options.threads,
                                             options.compact, parts);
  parts.insert(parts.end(), light_parts.begin(), light_parts.end());
  return result;
}

}  // namespace wisp
