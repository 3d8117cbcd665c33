// A lock of hair, and an Embree scene of it. Lengths are centimetres.

#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#define TOY_EMBREE 4
#else
#include <embree3/rtcore.h>
#define TOY_EMBREE 3
#endif

#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

#include "toy.h"

namespace toy {

struct ray {
  vec o, d;
  float tmin = 0, tmax = std::numeric_limits<float>::infinity();
};

struct fibres {
  std::vector<vec> points, tangents;    // at the vertices of all fibres
  std::vector<float> radius;            // the same
  std::vector<std::uint32_t> segments;  // their first vertices
  std::vector<std::uint32_t> fibre;     // the fibre of each segment
};

// A lock that hangs from a patch of skin: fibres keep their places in one of its strands,
// and the strands wave each in its own time.
inline fibres make_lock(int count, int pieces) {
  constexpr float pi = 3.14159265f;
  constexpr int strands = 14;
  fibres lock;
  random_numbers rng = {7};
  vec strand[strands];  // place in the section, and time
  for (vec& c : strand) {
    const float r = std::sqrt(rng.next()), t = 2 * pi * rng.next();
    c = {1.5f * r * std::cos(t), 1.2f * rng.next(), 0.9f * r * std::sin(t)};
  }
  for (int i = 0; i < count; i++) {
    const vec& c = strand[i % strands];
    const float place = 0.55f * std::sqrt(rng.next()), angle = 2 * pi * rng.next();
    const float reach = 0.8f + 0.2f * rng.next();
    const float phase = 2 * pi * rng.next(), stray = rng.next() < 0.06f ? 0.25f : 0.03f;
    const auto first = static_cast<std::uint32_t>(lock.points.size());
    for (int k = 0; k <= pieces; k++) {
      const float s = reach * static_cast<float>(k) / static_cast<float>(pieces);
      const float width = place * (1 - 0.75f * s), turn = angle + 3 * s, wave = 11 * s + c.y;
      const vec p = {c.x * (1 - 0.4f * s * s) + width * std::cos(turn) +
                         0.55f * s * std::sin(wave) + stray * s * std::sin(9 * s + phase),
                     6 - 12 * s,
                     c.z * (1 - 0.4f * s * s) + width * std::sin(turn) +
                         0.55f * s * std::cos(wave) + stray * s * std::cos(7 * s + phase)};
      lock.points.push_back(p);
      lock.radius.push_back(0.012f * (1 - 0.6f * s * s));
      if (k < pieces) {
        lock.segments.push_back(first + static_cast<std::uint32_t>(k));
        lock.fibre.push_back(static_cast<std::uint32_t>(i));
      }
    }
    const auto n = static_cast<std::uint32_t>(pieces);
    for (std::uint32_t k = 0; k <= n; k++)
      lock.tangents.push_back(normalize(lock.points[first + (k < n ? k + 1 : n)] -
                                        lock.points[first + (k > 0 ? k - 1 : 0)]));
  }
  return lock;
}

// Flat segments that turn to the ray: one number tells where across it meets them.
class ray_scene {
 public:
  explicit ray_scene(const fibres& f) {
    device_ = rtcNewDevice(nullptr);
    if (!device_) throw std::runtime_error("Embree does not start");
    scene_ = rtcNewScene(device_);
    RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_FLAT_LINEAR_CURVE);
    auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(
        g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 4 * sizeof(float), f.points.size()));
    auto* index = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT,
                                          sizeof(std::uint32_t), f.segments.size());
    if (!v || !index) throw std::runtime_error("Embree has no memory for the fibres");
    for (std::size_t i = 0; i < f.points.size(); i++) {
      const float xyzr[4] = {f.points[i].x, f.points[i].y, f.points[i].z, f.radius[i]};
      std::memcpy(v + 4 * i, xyzr, sizeof(xyzr));
    }
    std::memcpy(index, f.segments.data(), f.segments.size() * sizeof(std::uint32_t));
    rtcCommitGeometry(g);
    rtcAttachGeometry(scene_, g);
    rtcReleaseGeometry(g);
    rtcCommitScene(scene_);
    if (rtcGetDeviceError(device_) != RTC_ERROR_NONE)
      throw std::runtime_error("Embree does not take the fibres");
  }
  ~ray_scene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  ray_scene(const ray_scene&) = delete;
  ray_scene& operator=(const ray_scene&) = delete;

  // The segment that a ray meets first, and how far along it.
  struct hit {
    bool found = false;
    std::uint32_t segment = 0;
    float u = 0;
  };
  hit intersect(const ray& r) const {
    RTCRayHit q = {};
    q.ray = to_embree(r);
    q.hit.geomID = q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if TOY_EMBREE == 4
    rtcIntersect1(scene_, &q);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &q);
#endif
    return {q.hit.geomID != RTC_INVALID_GEOMETRY_ID, q.hit.primID, q.hit.u};
  }
  bool occluded(const ray& r) const {
    RTCRay q = to_embree(r);
#if TOY_EMBREE == 4
    rtcOccluded1(scene_, &q);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene_, &context, &q);
#endif
    return q.tfar < 0;
  }

 private:
  static RTCRay to_embree(const ray& r) {
    RTCRay q = {};
    q.org_x = r.o.x, q.org_y = r.o.y, q.org_z = r.o.z, q.tnear = r.tmin;
    q.dir_x = r.d.x, q.dir_y = r.d.y, q.dir_z = r.d.z, q.tfar = r.tmax;
    q.mask = 0xffffffffu;
    return q;
  }
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

}  // namespace toy
