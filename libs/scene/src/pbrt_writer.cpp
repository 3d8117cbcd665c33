// Writes strands as the curves of pbrt-v4: https://pbrt.org/fileformat-v4
//
// pbrt knows cubic Bezier curves and B-splines whose width runs linearly from
// end to end. Strands of other bases are written as exact Bezier curves, and a
// strand whose radius does not run linearly as one Shape for each piece.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "shape_formats.h"
#include "strand_sampling.h"

namespace wisp {

namespace {

constexpr float fallback_radius = 0.001f;  // as Yocto/GL has it for lines without one

bool nearly(float a, float b, float scale) { return std::abs(a - b) <= 1e-5f * scale; }

// Whether radii[i] = a + b i.
bool is_linear(std::span<const float> radii) {
  const float scale = std::abs(radii.front()) + std::abs(radii.back());
  const auto last = static_cast<float>(radii.size() - 1);
  for (std::size_t i = 0; i < radii.size(); ++i) {
    const float t = static_cast<float>(i) / last;
    if (!nearly(radii[i], radii.front() * (1 - t) + radii.back() * t, scale)) return false;
  }
  return true;
}

bool is_finite_strand(const shape_data& shape, std::size_t k) {
  for (uint32_t i = shape.strands[k]; i < shape.strands[k + 1]; ++i) {
    if (!is_finite(shape.positions[i])) return false;
    if (!shape.radius.empty() && !std::isfinite(shape.radius[i])) return false;
  }
  return true;
}

// A B-spline can stay one if its radius is linear along each strand.
bool stays_bspline(const shape_data& shape) {
  if (shape.basis != curve_basis::bspline) return false;
  if (shape.radius.empty()) return true;
  for (std::size_t k = 0; k < strand_count(shape); ++k) {
    const std::span<const float> radii(shape.radius.data() + shape.strands[k],
                                       shape.strands[k + 1] - shape.strands[k]);
    if (radii.size() >= 4 && !is_linear(radii)) return false;
  }
  return true;
}

void write_curve(std::string& out, const char* type, const char* basis,
                 std::span<const vec4> points, float r0, float r1) {
  auto to = std::back_inserter(out);
  fmt::format_to(to, "Shape \"curve\" \"string type\" \"{}\" \"string basis\" \"{}\"\n", type,
                 basis);
  fmt::format_to(to, "  \"float width0\" {} \"float width1\" {}\n  \"point3 P\" [", 2 * r0, 2 * r1);
  for (const vec4& p : points) fmt::format_to(to, " {} {} {}", p.x, p.y, p.z);
  out += " ]\n";
}

}  // namespace

std::string write_pbrt_curves(const shape_data& shape, const std::string& file,
                              warning_list& warnings) {
  if (strand_count(shape) == 0) {
    throw file_error(file, "",
                     "a .pbrt file is written for strands and the shape has none; .ply "
                     "holds faces and points");
  }
  const char* type = shape.profile == curve_profile::round ? "cylinder" : "flat";
  const bool bspline = stays_bspline(shape);
  std::size_t left_out = 0, bent = 0;
  std::string out = "# Curves written by wisp. A renderer's camera and lights are to be added.\n";
  for (std::size_t k = 0; k < strand_count(shape); ++k) {
    auto pieces = bezier_pieces(shape, k);
    if (pieces.empty() || !is_finite_strand(shape, k)) {
      ++left_out;
      continue;
    }
    std::vector<float> radii = {pieces[0][0].w};
    for (auto& piece : pieces) {
      if (shape.radius.empty()) {
        for (vec4& p : piece) p.w = fallback_radius;
      }
      radii.push_back(piece[3].w);
    }
    radii[0] = pieces[0][0].w;
    if (bspline) {
      std::vector<vec4> points;
      for (uint32_t i = shape.strands[k]; i < shape.strands[k + 1]; ++i) {
        points.push_back(vec4(shape.positions[i], 0.0f));
      }
      write_curve(out, type, "bspline", points, radii.front(), radii.back());
    } else if (is_linear(radii)) {
      std::vector<vec4> points = {pieces[0][0]};
      for (const auto& piece : pieces) points.insert(points.end(), piece.begin() + 1, piece.end());
      write_curve(out, type, "bezier", points, radii.front(), radii.back());
    } else {
      for (const auto& p : pieces) {
        const float scale = 1000 * std::max(p[0].w, p[3].w);  // one part in a hundred
        bent += !nearly(p[1].w, (2 * p[0].w + p[3].w) / 3, scale) ||
                !nearly(p[2].w, (p[0].w + 2 * p[3].w) / 3, scale);
        write_curve(out, type, "bezier", p, p[0].w, p[3].w);
      }
    }
  }
  auto say = [&](std::size_t count, const char* text) {
    if (count != 0) warnings.push_back(fmt::format("{}: {} {}", file, count, text));
  };
  say(left_out, "strands without a curve piece or with a vertex that is not finite were left out");
  say(bent, "curve pieces have a radius that is not linear; that of their ends was kept");
  if (shape.radius.empty()) {
    warnings.push_back(
        fmt::format("{}: the strands have no radius; {} was written", file, fallback_radius));
  }
  if (!shape.colors.empty() || !shape.texcoords.empty()) {
    warnings.push_back(fmt::format(
        "{}: the format has no colours or texture coordinates of points; they were left out",
        file));
  }
  if (!shape.roughness.empty()) {
    warnings.push_back(fmt::format(
        "{}: the format has no roughness of points; it was left out; .ply can hold it", file));
  }
  return out;
}

}  // namespace wisp
