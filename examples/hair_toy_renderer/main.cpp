// A toy path tracer with its own vectors and its own Embree scene, whose hair scatters
// light as wisp::hair says.
//
//   hair_toy_renderer [FILE.ppm [WIDTH [SAMPLES]]]      the picture goes to stdout for -
//
// Ends with 1 if the picture is not one of lit hair.

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <thread>
#include <vector>

#include "fibres.h"
#include "toy.h"
#include "wisp/hair/absorption.h"
#include "wisp/hair/bsdf.h"

namespace {

using namespace toy;
namespace hair = wisp::hair;

// ------------------------------------------------------------- glue to wisp::hair

// Where a ray meets a fibre: x along it from root to tip, z towards the viewer.
struct fibre_point {
  vec position, x, y, z;
  float h = 0, radius = 0;
};

glm::vec3 to_fibre(const fibre_point& p, vec w) { return {dot(w, p.x), dot(w, p.y), dot(w, p.z)}; }
vec from_fibre(const fibre_point& p, const glm::vec3& w) {
  return p.x * w.x + p.y * w.y + p.z * w.z;
}
vec color(const glm::vec3& c) { return {c.x, c.y, c.z}; }

fibre_point find_fibre_point(const fibres& f, const ray& r, const ray_scene::hit& hit) {
  const std::uint32_t a = f.segments[hit.segment], b = a + 1;
  fibre_point p;
  p.radius = f.radius[a] * (1 - hit.u) + f.radius[b] * hit.u;
  const vec axis = lerp(f.points[a], f.points[b], hit.u);
  // Perpendicular to the ray and to the fibre; for a ray along the fibre any will do.
  auto across = [&](vec tangent) {
    const vec c = cross(-r.d, tangent);
    return length(c) > 1e-6f ? normalize(c) : perpendicular(tangent);
  };
  // h is how far the ray passes by the axis of the segment, over the radius.
  const vec y = across(normalize(f.points[b] - f.points[a]));
  p.h = std::clamp(dot(r.o - axis, y) / p.radius, -1.0f, 1.0f);
  p.position = axis + y * (p.h * p.radius);
  // The frame follows the smooth fibre, so that segments do not show.
  p.x = normalize(lerp(f.tangents[a], f.tangents[b], hit.u));
  p.y = across(p.x);
  p.z = cross(p.x, p.y);
  return p;
}

// The model's light has gone through the fibre already: a ray starts behind it.
ray leave_fibre(const fibre_point& p, vec d) {
  const float along = dot(d, p.x);
  const float across = std::sqrt(std::max(1 - along * along, 0.01f));
  return {p.position, d, 2.1f * p.radius / across};
}

// ------------------------------------------------------------------------- light

// Round lamps at infinity, and a dim sky.
struct lamp {
  vec direction;  // to the lamp
  float cos_size = 1;
  vec radiance;
  float pdf() const { return 1 / (2 * 3.14159265f * (1 - cos_size)); }
};
const lamp lamps[2] = {{normalize({-0.55f, 0.5f, 0.85f}), 0.97f, {44, 41, 38}},
                       {normalize({0.8f, 0.35f, -0.75f}), 0.965f, {38, 41, 46}}};

vec sky(vec d) { return lerp({0.02f, 0.02f, 0.02f}, {0.2f, 0.24f, 0.3f}, 0.5f + 0.5f * d.y); }

vec sample_lamp(const lamp& l, float u, float v) {
  const float c = 1 - u * (1 - l.cos_size), s = std::sqrt(1 - c * c), t = 2 * 3.14159265f * v;
  const vec a = perpendicular(l.direction), b = cross(l.direction, a);
  return normalize(l.direction * c + a * (s * std::cos(t)) + b * (s * std::sin(t)));
}

float power_heuristic(float a, float b) { return a * a / (a * a + b * b); }

// ------------------------------------------------------------------------- paths

struct hair_scene {
  const fibres& hair;
  const ray_scene& rays;
  hair::hair_bsdf<float> bsdf;
  std::vector<glm::vec3> sigma_a;  // of each fibre
};

struct found_light {
  vec radiance;
  bool on_hair = false;
};

found_light trace(const hair_scene& scene, ray r, random_numbers& rng) {
  found_light light;
  vec weight = {1, 1, 1};
  float pdf = 0;  // of the last direction; 0 at the camera
  for (int bounce = 0; bounce < 64; bounce++) {
    const auto found = scene.rays.intersect(r);
    if (!found.found) {
      vec seen = sky(r.d);
      for (const lamp& l : lamps)
        if (dot(r.d, l.direction) > l.cos_size)
          seen = seen + l.radiance * (pdf > 0 ? power_heuristic(pdf, l.pdf()) : 1);
      light.radiance = light.radiance + weight * seen;
      return light;
    }
    light.on_hair = true;
    const fibre_point p = find_fibre_point(scene.hair, r, found);
    // All that follows from the hit; the lamps and the next direction share it.
    const auto hit =
        hair::make_hair_hit(scene.bsdf, scene.sigma_a[scene.hair.fibre[found.segment]], p.h,
                            to_fibre(p, -r.d), glm::vec3{weight.x, weight.y, weight.z});

    for (const lamp& l : lamps) {
      const float u = rng.next(), v = rng.next();
      const vec d = sample_lamp(l, u, v);
      const auto f = hair::eval_hair_with_pdf(scene.bsdf, hit, to_fibre(p, d));
      const vec c = weight * color(f.value) * l.radiance *
                    (power_heuristic(l.pdf(), f.pdf) / l.pdf());  // no cosine: f has it
      if (largest(c) > 0 && !scene.rays.occluded(leave_fibre(p, d)))
        light.radiance = light.radiance + c;
    }

    glm::vec4 u;
    for (int i = 0; i < 4; i++) u[i] = rng.next();
    const auto next = hair::sample_hair_with_pdf(scene.bsdf, hit, u);
    if (!(next.pdf > 0)) return light;
    weight = weight * color(next.value / next.pdf);
    pdf = next.pdf;
    const float survival = std::min(1.0f, 2 * largest(weight));
    if (rng.next() >= survival) return light;
    weight = weight * (1 / survival);
    r = leave_fibre(p, normalize(from_fibre(p, next.direction)));
  }
  return light;
}

// ----------------------------------------------------------------------- picture

struct picture {
  int width = 0, height = 0;
  std::vector<vec> pixels;
  std::vector<int> covered;  // samples that met hair
};

picture render(const hair_scene& scene, int width, int samples) {
  picture image;
  image.width = width;
  image.height = width * 3 / 2;
  image.pixels.resize(static_cast<std::size_t>(image.width * image.height));
  image.covered.resize(image.pixels.size());
  auto render_row = [&](int y) {
    for (int x = 0; x < image.width; x++) {
      const auto i = static_cast<std::size_t>(y * image.width + x);
      random_numbers rng = {static_cast<std::uint64_t>(i) << 32};
      for (int s = 0; s < samples; s++) {
        const float scale = 9.4f / static_cast<float>(image.width);  // centimetres of a pixel
        const float dx = (static_cast<float>(x) + rng.next()) * scale - 4.7f;
        const float dy = 7.05f - (static_cast<float>(y) + rng.next()) * scale;
        const vec eye = {0, 0, 40};
        const auto light = trace(scene, {eye, normalize(vec{dx, dy - 0.4f, 0} - eye)}, rng);
        image.pixels[i] = image.pixels[i] + light.radiance * (1 / static_cast<float>(samples));
        image.covered[i] += light.on_hair ? 1 : 0;
      }
    }
  };
  std::atomic<int> next_row = 0;
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < std::max(1u, std::thread::hardware_concurrency()); t++)
    threads.emplace_back([&] {
      for (int y = next_row++; y < image.height; y = next_row++) render_row(y);
    });
  for (auto& t : threads) t.join();
  return image;
}

bool save_ppm(const picture& image, const std::string& name) {
  std::FILE* file = name == "-" ? stdout : std::fopen(name.c_str(), "wb");
  if (!file) return false;
  std::fprintf(file, "P6\n%d %d\n255\n", image.width, image.height);
  auto encode = [](float c) {  // roughly sRGB
    return static_cast<unsigned char>(
        255 * std::pow(std::clamp(1 - std::exp(-1.5f * c), 0.0f, 1.0f), 1 / 2.2f) + 0.5f);
  };
  for (const vec& p : image.pixels)
    for (float c : {p.x, p.y, p.z}) std::fputc(encode(c), file);
  const bool good = std::ferror(file) == 0;
  return (name == "-" ? std::fflush(file) : std::fclose(file)) == 0 && good;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string name = argc > 1 ? argv[1] : "hair.ppm";
  const int width = argc > 2 ? std::atoi(argv[2]) : 120;
  const int samples = argc > 3 ? std::atoi(argv[3]) : 24;
  if (width < 8 || width > 8192 || samples < 1) {
    std::fprintf(stderr, "usage: hair_toy_renderer [FILE.ppm [WIDTH [SAMPLES]]]\n");
    return 2;
  }

  const int count = 2500;
  const fibres lock = make_lock(count, 40);
  const ray_scene rays(lock);
  // Brown, no two fibres alike. Scales of a negative tilt: the order of highlights that
  // is measured on real hair.
  const auto bsdf = hair::make_hair_bsdf<float>({.beta_m = 0.25f, .beta_n = 0.3f, .alpha = -2});
  std::vector<glm::vec3> sigma_a;
  random_numbers rng = {1};
  for (int i = 0; i < count; i++) {
    const float eumelanin = 0.3f + 0.4f * rng.next(), pheomelanin = 0.1f + 0.3f * rng.next();
    sigma_a.push_back(hair::sigma_a_from_melanin(eumelanin, pheomelanin));
  }
  const picture image = render({lock, rays, bsdf, sigma_a}, width, samples);
  if (!save_ppm(image, name)) {
    std::fprintf(stderr, "hair_toy_renderer: cannot write %s\n", name.c_str());
    return 1;
  }

  double red = 0, blue = 0, covered = 0;
  bool finite = true;
  for (std::size_t i = 0; i < image.pixels.size(); i++) {
    const vec& p = image.pixels[i];
    finite = finite && std::isfinite(p.x + p.y + p.z);
    if (image.covered[i] < samples) continue;
    red += static_cast<double>(p.x), blue += static_cast<double>(p.z), covered++;
  }
  red /= covered, blue /= covered, covered /= static_cast<double>(image.pixels.size());
  std::fprintf(stderr, "%d x %d, hair on %.1f %% of it: red %.3f, blue %.3f\n", image.width,
               image.height, 100 * covered, red, blue);
  const bool sane =
      finite && covered > 0.2 && covered < 0.3 && red > 0.14 && red < 0.25 && blue < 0.5 * red;
  if (!sane) std::fprintf(stderr, "hair_toy_renderer: this is not a picture of lit hair\n");
  return sane ? 0 : 1;
} catch (const std::exception& e) {
  std::fprintf(stderr, "hair_toy_renderer: %s\n", e.what());
  return 1;
}
