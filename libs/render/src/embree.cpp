// The one file that knows Embree (3.13 or 4).

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#define WISP_EMBREE 4
#else
#include <embree3/rtcore.h>
#define WISP_EMBREE 3
#endif

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>

#include "accel.h"
#include "wisp/geometry/sphere_trace.h"

namespace wisp {

namespace {

constexpr std::size_t kinds = 5;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void check(RTCDevice device, const char* what) {
  RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  const char* reason = error == RTC_ERROR_OUT_OF_MEMORY     ? "out of memory"
                       : error == RTC_ERROR_UNSUPPORTED_CPU ? "this processor lacks SSE2"
                                                            : "internal error";
  throw std::runtime_error(fmt::format("Embree failed while it {}: {}", what, reason));
}

bool count_bytes(void* user, ssize_t bytes, bool) {
  static_cast<std::atomic<int64_t>*>(user)->fetch_add(bytes);
  return true;
}

RTCGeometryType curve_type(curve_basis basis, curve_profile profile) {
  bool flat = profile == curve_profile::flat;
  switch (basis) {
    case curve_basis::bezier:
      return flat ? RTC_GEOMETRY_TYPE_FLAT_BEZIER_CURVE : RTC_GEOMETRY_TYPE_ROUND_BEZIER_CURVE;
    case curve_basis::bspline:
      return flat ? RTC_GEOMETRY_TYPE_FLAT_BSPLINE_CURVE : RTC_GEOMETRY_TYPE_ROUND_BSPLINE_CURVE;
    case curve_basis::catmull_rom:
      return flat ? RTC_GEOMETRY_TYPE_FLAT_CATMULL_ROM_CURVE
                  : RTC_GEOMETRY_TYPE_ROUND_CATMULL_ROM_CURVE;
    default:
      break;
  }
  return flat ? RTC_GEOMETRY_TYPE_FLAT_LINEAR_CURVE : RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE;
}

// Embree reads 16 bytes at every vertex, so the last of a packed array of three
// floats must not be the end of the memory.
void pad_for_embree(std::vector<vec3>& positions) {
  if (positions.capacity() < positions.size() + 2) positions.reserve(positions.size() + 2);
}

template <typename T>
void share(RTCGeometry geometry, RTCBufferType type, RTCFormat format, const std::vector<T>& data,
           std::size_t count) {
  rtcSetSharedGeometryBuffer(geometry, type, 0, format, data.data(), 0, sizeof(T), count);
}

// A solid is one element of a kind that Embree does not know: it asks for its box,
// and for hits within.
struct cut_solid {
  sdf solid = {};
  std::vector<cut_plane> cuts = {};
};

void bound_solid(const RTCBoundsFunctionArguments* args) {
  const dbox3 box = properties(static_cast<const cut_solid*>(args->geometryUserPtr)->solid).bounds;
  RTCBounds& b = *args->bounds_o;
  const dvec3 margin = 1e-6 * (glm::abs(box.min) + glm::abs(box.max));
  const vec3 low(box.min - margin), high(box.max + margin);
  b.lower_x = low.x, b.lower_y = low.y, b.lower_z = low.z;
  b.upper_x = high.x, b.upper_y = high.y, b.upper_z = high.z;
}

trace_result trace_solid(const void* user, const RTCRay& r) {
  const auto& solid = *static_cast<const cut_solid*>(user);
  sphere_trace_options options;
  options.tolerance = 1e-8;  // rays are floats
  options.t_min = static_cast<double>(r.tnear);
  options.t_max = static_cast<double>(r.tfar);
  const sdf_ray ray = {dvec3{r.org_x, r.org_y, r.org_z}, dvec3{r.dir_x, r.dir_y, r.dir_z}};
  return solid.cuts.empty() ? sphere_trace(solid.solid, ray, options)
                            : sphere_trace(solid.solid, solid.cuts, ray, options);
}

// Rays are traced one at a time, so that N is 1.
void intersect_solid(const RTCIntersectFunctionNArguments* args) {
  if (args->valid[0] == 0) return;
  auto& r = *reinterpret_cast<RTCRayHit*>(args->rayhit);
  const trace_result result = trace_solid(args->geometryUserPtr, r.ray);
  if (result.end != trace_end::hit) return;
  r.ray.tfar = static_cast<float>(result.at.t);
  const vec3 n(result.at.normal);
  r.hit.Ng_x = n.x, r.hit.Ng_y = n.y, r.hit.Ng_z = n.z;
  r.hit.u = r.hit.v = 0;
  r.hit.primID = static_cast<unsigned>(result.at.plane + 1);
  r.hit.geomID = args->geomID;
  r.hit.instID[0] = args->context->instID[0];
}

void occlude_solid(const RTCOccludedFunctionNArguments* args) {
  if (args->valid[0] == 0) return;
  auto& ray = *reinterpret_cast<RTCRay*>(args->ray);
  if (trace_solid(args->geometryUserPtr, ray).end == trace_end::hit) ray.tfar = -infinity;
}

}  // namespace

struct ray_accel::impl {
  RTCDevice device = nullptr;
  RTCScene top = nullptr;
  std::atomic<int64_t> bytes = 0;
  // A geometry of the top scene: an instance of a shape's scene, or one kind of
  // element of a shape that is used once.
  struct top_entry {
    int instance = invalid_id;
    bool nested = false;
    element_kind kind = element_kind::triangle;
  };
  std::vector<top_entry> entries = {};
  std::vector<RTCScene> shape_scenes = {};
  std::vector<curve_geometry> curves = {};
  std::vector<cut_solid> solids = {};
  std::vector<std::vector<vec4>> spheres = {};
  std::vector<std::vector<uint8_t>> flags = {};
  std::vector<mat3> normal_matrices = {};  // of nested instances

  ~impl() {
    for (RTCScene scene : shape_scenes)
      if (scene) rtcReleaseScene(scene);
    if (top) rtcReleaseScene(top);
    if (device) rtcReleaseDevice(device);
  }

  std::vector<strand_use> use = {};

  RTCGeometry make_geometry(shape_data& shape, std::size_t shape_id, element_kind kind);
};

RTCGeometry ray_accel::impl::make_geometry(shape_data& shape, std::size_t shape_id,
                                           element_kind kind) {
  RTCGeometry geometry = nullptr;
  switch (kind) {
    case element_kind::triangle:
      if (shape.triangles.empty()) return nullptr;
      geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
      share(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, shape.positions,
            shape.positions.size());
      share(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, shape.triangles,
            shape.triangles.size());
      break;
    case element_kind::quad:
      if (shape.quads.empty()) return nullptr;
      geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
      share(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, shape.positions,
            shape.positions.size());
      share(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT4, shape.quads, shape.quads.size());
      break;
    case element_kind::strand: {
      if (strand_count(shape) == 0) return nullptr;
      curves[shape_id] = take_curves(shape, use[shape_id]);
      const curve_geometry& c = curves[shape_id];
      if (c.segments.empty()) return nullptr;
      geometry = rtcNewGeometry(device, curve_type(c.basis, c.profile));
      share(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, c.vertices, c.vertices.size());
      share(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, c.segments, c.segments.size());
      if (c.basis == curve_basis::linear && c.profile == curve_profile::round) {
        auto& f = flags[shape_id];
        f.resize(c.segments.size());
        for (std::size_t i = 0; i < f.size(); i++) {
          bool left = i > 0 && c.segments[i - 1] + 1 == c.segments[i];
          bool right = i + 1 < f.size() && c.segments[i] + 1 == c.segments[i + 1];
          f[i] = static_cast<uint8_t>((left ? RTC_CURVE_FLAG_NEIGHBOR_LEFT : 0) |
                                      (right ? RTC_CURVE_FLAG_NEIGHBOR_RIGHT : 0));
        }
        share(geometry, RTC_BUFFER_TYPE_FLAGS, RTC_FORMAT_UCHAR, f, f.size());
      }
      break;
    }
    case element_kind::point: {
      if (shape.points.empty()) return nullptr;
      auto& s = spheres[shape_id];
      s.reserve(shape.points.size());
      for (int p : shape.points) {
        auto i = static_cast<std::size_t>(p);
        s.emplace_back(shape.positions[i], i < shape.radius.size() ? shape.radius[i] : 0.001f);
      }
      geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
      share(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, s, s.size());
      break;
    }
    case element_kind::solid:
      if (shape_id >= solids.size() || is_empty(properties(solids[shape_id].solid).bounds))
        return nullptr;
      geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
      rtcSetGeometryUserPrimitiveCount(geometry, 1);
      rtcSetGeometryUserData(geometry, &solids[shape_id]);
      rtcSetGeometryBoundsFunction(geometry, bound_solid, nullptr);
      rtcSetGeometryIntersectFunction(geometry, intersect_solid);
      rtcSetGeometryOccludedFunction(geometry, occlude_solid);
      break;
  }
  rtcCommitGeometry(geometry);
  check(device, "took over the geometry of a shape");
  return geometry;
}

ray_accel::ray_accel(scene_data& scene, std::vector<traced_solid>&& solids, int threads,
                     bool compact, std::vector<part_report>& parts)
    : impl_(std::make_unique<impl>()) {
  impl& a = *impl_;
  for (const auto& solid : solids) {
    cut_solid& cut = a.solids.emplace_back(cut_solid{solid.solid, {}});
    for (const auto& plane : solid.cuts) cut.cuts.push_back({plane.point, plane.normal});
  }
  std::string config = threads > 0 ? fmt::format("threads={}", threads) : std::string();
  a.device = rtcNewDevice(config.empty() ? nullptr : config.c_str());
  if (!a.device) throw std::runtime_error("Embree does not start: this processor lacks SSE2");
  rtcSetDeviceMemoryMonitorFunction(a.device, count_bytes, &a.bytes);

  std::vector<int> uses(scene.shapes.size(), 0);
  for (const auto& instance : scene.instances) uses[static_cast<std::size_t>(instance.shape)]++;
  for (std::size_t s = 0; s < scene.shapes.size(); s++)
    if (uses[s] == 1 && keeps_space(scene, scene.shapes[s])) uses[s] = 2;
  a.shape_scenes.resize(scene.shapes.size(), nullptr);
  a.curves.resize(scene.shapes.size());
  a.use = find_strand_use(scene);
  a.spheres.resize(scene.shapes.size());
  a.flags.resize(scene.shapes.size());
  a.normal_matrices.resize(scene.instances.size());
  for (auto& shape : scene.shapes)
    if (!shape.triangles.empty() || !shape.quads.empty()) pad_for_embree(shape.positions);

  auto flags = static_cast<RTCSceneFlags>(compact ? RTC_SCENE_FLAG_COMPACT : RTC_SCENE_FLAG_NONE);
  auto new_scene = [&] {
    RTCScene s = rtcNewScene(a.device);
    rtcSetSceneFlags(s, flags);
    rtcSetSceneBuildQuality(s, RTC_BUILD_QUALITY_MEDIUM);
    return s;
  };
  a.top = new_scene();
  element_use used = count_elements(scene);
  std::array<std::size_t, kinds> counts = {used.triangles, used.quads, used.strands, used.points,
                                           used.solids};
  const std::array<const char*, kinds> names = {"triangle rays", "quad rays", "curve rays",
                                                "point rays", "solid rays"};
  const std::array<const char*, kinds> things = {"triangles", "quads", "curve segments", "points",
                                                 "traced solids"};

  // Kind by kind, so that each has a row of its own in the report.
  for (std::size_t k = 0; k < kinds; k++) {
    double start = now();
    int64_t bytes = a.bytes;
    auto kind = static_cast<element_kind>(k);
    for (std::size_t i = 0; i < scene.instances.size(); i++) {
      auto shape_id = static_cast<std::size_t>(scene.instances[i].shape);
      if (uses[shape_id] > 1) continue;
      RTCGeometry geometry = a.make_geometry(scene.shapes[shape_id], shape_id, kind);
      if (!geometry) continue;
      unsigned id = rtcAttachGeometry(a.top, geometry);
      rtcReleaseGeometry(geometry);
      if (a.entries.size() <= id) a.entries.resize(id + 1);
      a.entries[id] = {static_cast<int>(i), false, kind};
    }
    for (std::size_t s = 0; s < scene.shapes.size(); s++) {
      if (uses[s] < 2) continue;
      RTCGeometry geometry = a.make_geometry(scene.shapes[s], s, kind);
      if (!geometry) continue;
      if (!a.shape_scenes[s]) a.shape_scenes[s] = new_scene();
      rtcAttachGeometryByID(a.shape_scenes[s], geometry, static_cast<unsigned>(k));
      rtcReleaseGeometry(geometry);
    }
    std::size_t own = 0;
    if (kind == element_kind::strand)
      for (const auto& c : a.curves)
        own += (c.vertices.size() + c.colors.size()) * sizeof(vec4) +
               (c.texcoords.size() + c.roughness.size()) * sizeof(vec2) +
               (c.segments.size() + c.strands.size() + c.places.size()) * sizeof(uint32_t);
    if (kind == element_kind::point)
      for (const auto& s : a.spheres) own += s.size() * sizeof(vec4);
    parts.push_back({names[k], counts[k] > 0,
                     counts[k] > 0 ? fmt::format("{} {}", counts[k], things[k])
                                   : fmt::format("no {} in the scene", things[k]),
                     now() - start,
                     own + static_cast<std::size_t>(std::max<int64_t>(0, a.bytes - bytes))});
  }

  double start = now();
  int64_t bytes = a.bytes;
  for (RTCScene s : a.shape_scenes)
    if (s) rtcCommitScene(s);
  check(a.device, "built the tree of a shape");
  for (std::size_t i = 0; i < scene.instances.size(); i++) {
    const auto& instance = scene.instances[i];
    auto shape_id = static_cast<std::size_t>(instance.shape);
    if (!a.shape_scenes[shape_id]) continue;
    RTCGeometry geometry = rtcNewGeometry(a.device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, a.shape_scenes[shape_id]);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &instance.frame);
    rtcCommitGeometry(geometry);
    unsigned id = rtcAttachGeometry(a.top, geometry);
    rtcReleaseGeometry(geometry);
    if (a.entries.size() <= id) a.entries.resize(id + 1);
    a.entries[id] = {static_cast<int>(i), true, element_kind::triangle};
    a.normal_matrices[i] = glm::transpose(glm::inverse(rotation(instance.frame)));
  }
  rtcCommitScene(a.top);
  check(a.device, "built the tree of the scene");
  parts.push_back({"ray tree", true, "rays are traced", now() - start,
                   static_cast<std::size_t>(std::max<int64_t>(0, a.bytes - bytes))});
  parts.push_back({"instances", used.instanced > 0,
                   used.instanced > 0 ? fmt::format("{} instances share a shape", used.instanced)
                                      : "no shape is used twice",
                   0, 0});
}

ray_accel::~ray_accel() = default;

const curve_geometry& ray_accel::curves(int shape) const {
  return impl_->curves[static_cast<std::size_t>(shape)];
}

namespace {

// What Embree takes; a ray beyond that, of a scene at the ends of float's range,
// meets nothing.
bool can_be_traced(const ray3& ray) {
  constexpr float largest = 1.8e18f;
  for (int i = 0; i < 3; i++)
    if (!(std::abs(ray.o[i]) < largest && std::abs(ray.d[i]) < largest)) return false;
  return ray.d != vec3{0, 0, 0};
}

}  // namespace

bool ray_accel::intersect(const ray3& ray, ray_hit& hit) const {
  if (!can_be_traced(ray)) return false;
  RTCRayHit r;
  r.ray = {ray.o.x, ray.o.y, ray.o.z,  ray.tmin,    ray.d.x, ray.d.y,
           ray.d.z, 0,       ray.tmax, 0xffffffffu, 0,       0};
  r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if WISP_EMBREE == 4
  rtcIntersect1(impl_->top, &r);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(impl_->top, &context, &r);
#endif
  if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
  bool nested = r.hit.instID[0] != RTC_INVALID_GEOMETRY_ID;
  const auto& entry = impl_->entries[nested ? r.hit.instID[0] : r.hit.geomID];
  hit.instance = entry.instance;
  hit.kind = nested ? static_cast<element_kind>(r.hit.geomID) : entry.kind;
  hit.element = r.hit.primID;
  hit.uv = {r.hit.u, r.hit.v};
  hit.t = r.ray.tfar;
  hit.ng = {r.hit.Ng_x, r.hit.Ng_y, r.hit.Ng_z};
  if (nested) hit.ng = impl_->normal_matrices[static_cast<std::size_t>(entry.instance)] * hit.ng;
  return true;
}

bool ray_accel::occluded(const ray3& ray) const {
  if (!can_be_traced(ray)) return false;
  RTCRay r = {ray.o.x, ray.o.y, ray.o.z,  ray.tmin,    ray.d.x, ray.d.y,
              ray.d.z, 0,       ray.tmax, 0xffffffffu, 0,       0};
#if WISP_EMBREE == 4
  rtcOccluded1(impl_->top, &r);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(impl_->top, &context, &r);
#endif
  return r.tfar < 0;
}

bool is_traced(const scene_data& scene, const shape_data& shape) {
  if (shape.solid == invalid_id || !shape.triangles.empty()) return false;
  const auto solid = static_cast<std::size_t>(shape.solid);
  return scene.solids[solid].display == solid_display::trace;
}

element_use count_elements(const scene_data& scene) {
  element_use use;
  std::vector<int> uses(scene.shapes.size(), 0);
  for (const auto& instance : scene.instances) uses[static_cast<std::size_t>(instance.shape)]++;
  for (std::size_t s = 0; s < scene.shapes.size(); s++) {
    if (uses[s] == 0) continue;
    const auto& shape = scene.shapes[s];
    use.triangles += shape.triangles.size();
    use.quads += shape.quads.size();
    use.points += shape.points.size();
    use.solids += is_traced(scene, shape) ? 1 : 0;
    for (std::size_t k = 0; k + 1 < shape.strands.size(); k++)
      use.strands += segment_count(shape.basis, shape.strands[k + 1] - shape.strands[k]);
    if (uses[s] > 1) use.instanced += static_cast<std::size_t>(uses[s]);
  }
  return use;
}

}  // namespace wisp
