// embree_point_query MESH.ply POINTS.f64 ... [--seconds S] [--repeats N] [--distances OUT.f64 ...]
//
// Closest points by Embree 3's rtcPointQuery, one thread, for peers.py: Embree's tree
// finds the leaves, the callback below computes the distance to a triangle in float
// (Ericson, Real-Time Collision Detection, 2005, section 5.1.5). Reads the meshes and
// the points that make_meshes.py writes and prints JSON with the fields of peers.py:
// rates are queries in a second of CPU time, the median of N batches of about S seconds.
// --distances writes the distances of all points of each file, float64, not timed.

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

static_assert(std::endian::native == std::endian::little, "files are read as they lie on disk");

namespace {

struct vec3 {
  float x, y, z;
};

vec3 operator-(vec3 a, vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
vec3 operator+(vec3 a, vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
vec3 operator*(vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
float dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

using corners = std::array<std::uint32_t, 3>;

struct mesh {
  std::vector<vec3> vertices;
  std::vector<corners> triangles;
};

std::string read_file(const std::string& path) {
  std::ifstream in{path, std::ios::binary};
  if (!in) throw std::runtime_error{path + ": cannot be opened"};
  std::ostringstream data;
  data << in.rdbuf();
  return std::move(data).str();
}

mesh read_ply(const std::string& path) {
  const std::string data = read_file(path);
  const std::string_view last = "end_header\n";
  const std::size_t end = data.find(last);
  const std::string wrong =
      path + ": not a PLY as make_meshes.py writes them (binary little-endian, float x y z)";
  if (end == std::string::npos) throw std::runtime_error{wrong};
  std::istringstream header{data.substr(0, end)};
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  int properties = 0;
  bool binary = false;
  for (std::string line; std::getline(header, line);) {
    std::istringstream words{line};
    std::string first;
    std::string second;
    words >> first >> second;
    if (first == "element" && second == "vertex") words >> vertices;
    if (first == "element" && second == "face") words >> triangles;
    if (line == "format binary_little_endian 1.0") binary = true;
    if (first == "property") {
      if (second != "float" && line != "property list uchar int vertex_indices")
        throw std::runtime_error{wrong};
      ++properties;
    }
  }
  constexpr std::size_t face_bytes = 1 + sizeof(corners);
  const std::size_t rest = data.size() - end - last.size();
  if (!binary || properties != 4 || vertices > rest / sizeof(vec3) ||
      triangles > rest / face_bytes || rest != vertices * sizeof(vec3) + triangles * face_bytes)
    throw std::runtime_error{wrong};
  mesh made;
  made.vertices.resize(vertices);
  made.triangles.resize(triangles);
  const char* from = data.data() + end + last.size();
  std::memcpy(made.vertices.data(), from, vertices * sizeof(vec3));
  from += vertices * sizeof(vec3);
  for (corners& triangle : made.triangles) {
    if (*from != 3) throw std::runtime_error{wrong};
    std::memcpy(triangle.data(), from + 1, sizeof(corners));
    from += face_bytes;
    for (const std::uint32_t corner : triangle)
      if (corner >= vertices) throw std::runtime_error{path + ": a corner is out of range"};
  }
  return made;
}

std::vector<vec3> read_points(const std::string& path) {
  const std::string data = read_file(path);
  if (data.empty() || data.size() % (3 * sizeof(double)) != 0)
    throw std::runtime_error{path + ": wants to be float64 x y z of at least one point"};
  std::vector<double> numbers(data.size() / sizeof(double));
  std::memcpy(numbers.data(), data.data(), data.size());
  std::vector<vec3> points(numbers.size() / 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = {static_cast<float>(numbers[3 * i]), static_cast<float>(numbers[3 * i + 1]),
                 static_cast<float>(numbers[3 * i + 2])};
  return points;
}

vec3 closest_on_triangle(vec3 p, vec3 a, vec3 b, vec3 c) {
  const vec3 ab = b - a;
  const vec3 ac = c - a;
  const vec3 ap = p - a;
  const float d1 = dot(ab, ap);
  const float d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const vec3 bp = p - b;
  const float d3 = dot(ab, bp);
  const float d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  const vec3 cp = p - c;
  const float d5 = dot(ab, cp);
  const float d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const float scale = 1 / (va + vb + vc);
  return a + ab * (vb * scale) + ac * (vc * scale);
}

struct found {
  const mesh* surface;
  float squared;
  unsigned triangle;
};

bool look_at_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& best = *static_cast<found*>(arguments->userPtr);
  const vec3 p{arguments->query->x, arguments->query->y, arguments->query->z};
  const corners& t = best.surface->triangles[arguments->primID];
  const std::vector<vec3>& v = best.surface->vertices;
  const vec3 to = p - closest_on_triangle(p, v[t[0]], v[t[1]], v[t[2]]);
  const float squared = dot(to, to);
  if (!(squared < best.squared)) return false;
  best.squared = squared;
  best.triangle = arguments->primID;
  arguments->query->radius = std::sqrt(squared);
  return true;  // the radius shrank
}

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

std::size_t status_bytes(std::string_view field) {
  std::ifstream status{"/proc/self/status"};
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(field)) {
      std::istringstream words{line.substr(field.size() + 1)};
      std::size_t kilobytes = 0;
      words >> kilobytes;
      return kilobytes * 1024;
    }
  return 0;
}

struct release {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
using device_handle = std::unique_ptr<RTCDeviceTy, release>;
using scene_handle = std::unique_ptr<RTCSceneTy, release>;

scene_handle build(RTCDevice device, const mesh& surface) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  // Shared with the mesh; the last vertex is read with 16 bytes, see the reserve in main.
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                             surface.vertices.data(), 0, sizeof(vec3), surface.vertices.size());
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                             surface.triangles.data(), 0, sizeof(corners),
                             surface.triangles.size());
  rtcSetGeometryPointQueryFunction(geometry, look_at_triangle);
  rtcCommitGeometry(geometry);
  scene_handle scene{rtcNewScene(device)};
  rtcAttachGeometry(scene.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene.get());
  if (rtcGetDeviceError(device) != RTC_ERROR_NONE)
    throw std::runtime_error{"Embree could not build the tree"};
  return scene;
}

found query(RTCScene scene, const mesh& surface, vec3 p) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  found best{&surface, infinity, RTC_INVALID_GEOMETRY_ID};
  RTCPointQuery at{p.x, p.y, p.z, 0, infinity};
  RTCPointQueryContext context{};
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene, &at, &context, nullptr, &best);
  return best;
}

double run(RTCScene scene, const mesh& surface, const std::vector<vec3>& points, std::size_t count,
           double& sum) {
  const double start = cpu_seconds();
  for (std::size_t i = 0; i < count; ++i)
    sum += static_cast<double>(query(scene, surface, points[i]).squared);
  return std::max(cpu_seconds() - start, 1e-6);
}

struct options {
  std::string mesh;
  std::vector<std::string> points;
  std::vector<std::string> distances;
  double seconds = 0.3;
  int repeats = 5;
};

options parse(int argc, char** argv) {
  options chosen;
  bool to_distances = false;
  const auto number = [&](int& i) {
    const std::string name = argv[i];
    char* end = nullptr;
    const double value = ++i < argc ? std::strtod(argv[i], &end) : 0;
    if (end == nullptr || *end != '\0' || !(value > 0 && value < 1e6))
      throw std::runtime_error{name + " wants a positive number"};
    return value;
  };
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--seconds")
      chosen.seconds = number(i);
    else if (word == "--repeats")
      chosen.repeats = std::max(1, static_cast<int>(number(i)));
    else if (word == "--distances")
      to_distances = true;
    else if (word.starts_with("--"))
      throw std::runtime_error{"no option " + word};
    else if (to_distances)
      chosen.distances.push_back(word);
    else if (chosen.mesh.empty())
      chosen.mesh = word;
    else
      chosen.points.push_back(word);
  }
  if (chosen.points.empty() || (to_distances && chosen.distances.size() != chosen.points.size()))
    throw std::runtime_error{
        "usage: embree_point_query MESH.ply POINTS.f64 ... [--seconds S] [--repeats N] "
        "[--distances OUT.f64 ..., one for each POINTS]"};
  return chosen;
}

// "bunny.near.f64" holds the points "near".
std::string set_name(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  const std::size_t before = path.rfind('.', dot == 0 ? 0 : dot - 1);
  return dot == std::string::npos || before == std::string::npos
             ? path
             : path.substr(before + 1, dot - before - 1);
}

void write_distances(RTCScene scene, const mesh& surface, const std::vector<vec3>& points,
                     const std::string& path) {
  std::ofstream out{path, std::ios::binary};
  for (const vec3 p : points) {
    const double d = std::sqrt(static_cast<double>(query(scene, surface, p).squared));
    out.write(reinterpret_cast<const char*>(&d), sizeof d);
  }
  if (!out) throw std::runtime_error{path + ": cannot be written"};
}

void measure(const options& chosen) {
  mesh surface = read_ply(chosen.mesh);
  if (surface.triangles.empty()) throw std::runtime_error{chosen.mesh + ": has no triangles"};
  surface.vertices.reserve(surface.vertices.size() + 2);
  vec3 low = surface.vertices[0];
  vec3 high = low;
  for (const vec3 v : surface.vertices) {
    low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
    high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
  }
  const device_handle device{rtcNewDevice("threads=1")};
  if (device == nullptr) throw std::runtime_error{"Embree does not start"};

  { std::ofstream{"/proc/self/clear_refs"} << "5"; }  // the peak starts again from here
  const std::size_t before = status_bytes("VmRSS");
  scene_handle scene = build(device.get(), surface);
  const std::size_t peak = status_bytes("VmHWM");
  const std::size_t held = status_bytes("VmRSS");
  std::vector<double> times;
  for (int i = 0; i < chosen.repeats; ++i) {
    scene.reset();
    const double start = cpu_seconds();
    scene = build(device.get(), surface);
    times.push_back(cpu_seconds() - start);
  }
  const double build_seconds = median(times);

  double sum = 0;  // of all results, so that no query can be left out
  std::string records;
  for (std::size_t set = 0; set < chosen.points.size(); ++set) {
    const std::vector<vec3> points = read_points(chosen.points[set]);
    std::size_t count = std::min<std::size_t>(points.size(), 64);
    double taken = run(scene.get(), surface, points, count, sum);
    while (taken < 0.2 * chosen.seconds && count < points.size()) {
      const double more = std::min(8.0, 0.3 * chosen.seconds / taken);
      count =
          std::min(points.size(), static_cast<std::size_t>(static_cast<double>(count) * more) + 1);
      taken = run(scene.get(), surface, points, count, sum);
    }
    const double wanted = static_cast<double>(count) * chosen.seconds / taken;
    count = std::clamp<std::size_t>(static_cast<std::size_t>(wanted), 1, points.size());
    times.clear();
    for (int i = 0; i < chosen.repeats; ++i)
      times.push_back(run(scene.get(), surface, points, count, sum));
    if (!chosen.distances.empty())
      write_distances(scene.get(), surface, points, chosen.distances[set]);
    char line[256];
    std::snprintf(line, sizeof line,
                  "%s\n  {\"task\": \"closest\", \"points\": \"%s\", \"rate\": %.6g, "
                  "\"batch\": %zu}",
                  set == 0 ? "" : ",", set_name(chosen.points[set]).c_str(),
                  static_cast<double>(count) / median(times), count);
    records += line;
  }
  const vec3 size = high - low;
  std::printf(
      "{\"triangles\": %zu, \"diagonal\": %.9g, \"build_seconds\": %.6g, \"held_bytes\": %lld, "
      "\"peak_bytes\": %lld, \"version\": %d, \"sum\": %.9g, \"records\": [%s\n]}\n",
      surface.triangles.size(), static_cast<double>(std::sqrt(dot(size, size))), build_seconds,
      static_cast<long long>(held) - static_cast<long long>(before),
      static_cast<long long>(peak) - static_cast<long long>(before),
      static_cast<int>(rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_VERSION)), sum,
      records.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  try {
    measure(parse(argc, argv));
  } catch (const std::exception& error) {
    std::cerr << "embree_point_query: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
