// Cem Yuksel's HAIR format: http://www.cemyuksel.com/research/hairmodels
//
// A header of 128 bytes, then up to five arrays in this order: segments of each
// strand (u16), points (3 f32), thickness (f32), transparency (f32), colour
// (3 f32), the last four for each point. All little endian.
//
// The specification leaves open what thickness is measured across. It is read
// and written as the diameter of the fibre: radius = thickness / 2. The array of
// transparencies becomes alpha = 1 - transparency; the default transparency of
// the header is not used, since well-known files set it for another renderer's
// blending and not for the fibre. The default colour is used when it is
// neither white nor black, which careless writers leave there.

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "hair_bytes.h"
#include "shape_formats.h"
#include "strand_sampling.h"

namespace wisp {

namespace {

constexpr uint64_t header_size = 128;
constexpr uint32_t has_segments = 1, has_points = 2, has_thickness = 4, has_transparency = 8,
                   has_colors = 16;

struct hair_header {
  uint32_t strands = 0;
  uint32_t points = 0;
  uint32_t flags = 0;
  uint32_t segments = 0;
  float thickness = 0;
  vec3 color = {1, 1, 1};
};

hair_header read_header(std::span<const uint8_t> bytes, const std::string& file) {
  if (bytes.size() < header_size) {
    throw file_error(file, "",
                     fmt::format("is {} bytes long, but a .hair file begins with a "
                                 "header of {} bytes; is the file cut short?",
                                 bytes.size(), header_size));
  }
  constexpr std::array<uint8_t, 4> magic = {'H', 'A', 'I', 'R'};
  if (!std::equal(magic.begin(), magic.end(), bytes.begin())) {
    throw file_error(file, "byte 0", "does not begin with HAIR and so is no .hair file");
  }
  hair_header header;
  header.strands = get_u32(bytes, 4);
  header.points = get_u32(bytes, 8);
  header.flags = get_u32(bytes, 12);
  header.segments = get_u32(bytes, 16);
  header.thickness = get_f32(bytes, 20);
  header.color = get_vec3(bytes, 28);
  if ((header.flags & has_points) == 0) {
    throw file_error(file, "byte 12",
                     "the header says that there is no array of points, which "
                     "every .hair file needs (bit 2 of the flags)");
  }
  const uint64_t per_point = 12 + ((header.flags & has_thickness) ? 4u : 0u) +
                             ((header.flags & has_transparency) ? 4u : 0u) +
                             ((header.flags & has_colors) ? 12u : 0u);
  const uint64_t wanted = header_size +
                          ((header.flags & has_segments) ? uint64_t{header.strands} * 2 : 0) +
                          uint64_t{header.points} * per_point;
  if (bytes.size() < wanted) {
    throw file_error(file, "",
                     fmt::format("is {} bytes long, but its header announces {} strands "
                                 "with {} points, which need {}; is the file cut short?",
                                 bytes.size(), header.strands, header.points, wanted));
  }
  // Without an array of segments nothing but the points bounds the strands.
  if ((header.flags & has_segments) == 0 &&
      uint64_t{header.strands} * (uint64_t{header.segments} + 1) > header.points) {
    throw file_error(file, "byte 16",
                     fmt::format("{} strands of {} segments need more than the {} points that the "
                                 "header announces",
                                 header.strands, header.segments, header.points));
  }
  return header;
}

// Where strands begin and the last one ends.
std::vector<uint32_t> read_strands(std::span<const uint8_t> bytes, const hair_header& header,
                                   const std::string& file) {
  std::vector<uint32_t> ends = {0};
  ends.reserve(std::size_t{header.strands} + 1);
  uint64_t end = 0;
  for (uint32_t k = 0; k < header.strands; ++k) {
    const uint64_t segments = (header.flags & has_segments)
                                  ? get_u16(bytes, header_size + 2 * uint64_t{k})
                                  : header.segments;
    end += segments + 1;
    if (end > header.points) {
      throw file_error(file, fmt::format("strand {}", k),
                       fmt::format("ends after point {}, but the header announces {} points", end,
                                   header.points));
    }
    ends.push_back(static_cast<uint32_t>(end));
  }
  return ends;
}

}  // namespace

shape_data read_hair(std::span<const uint8_t> bytes, const std::string& file,
                     warning_list& warnings) {
  const hair_header header = read_header(bytes, file);
  shape_data shape;
  shape.basis = curve_basis::linear;
  shape.strands = read_strands(bytes, header, file);
  const uint32_t count = shape.strands.back();
  if (count < header.points) {
    warnings.push_back(fmt::format("{}: {} points after the last strand were ignored", file,
                                   header.points - count));
  }

  uint64_t at = header_size + ((header.flags & has_segments) ? uint64_t{header.strands} * 2 : 0);
  shape.positions.resize(count);
  for (uint32_t i = 0; i < count; ++i) shape.positions[i] = get_vec3(bytes, at + 12 * uint64_t{i});
  at += 12 * uint64_t{header.points};

  if (header.flags & has_thickness) {
    shape.radius.resize(count);
    std::size_t bad = 0;
    for (uint32_t i = 0; i < count; ++i) {
      const float thickness = get_f32(bytes, at + 4 * uint64_t{i});
      const bool good = std::isfinite(thickness) && thickness >= 0;
      shape.radius[i] = good ? thickness / 2 : 0;
      bad += !good;
    }
    if (bad != 0) {
      warnings.push_back(fmt::format(
          "{}: {} points have a thickness that is negative or not finite; it was taken as 0", file,
          bad));
    }
    at += 4 * uint64_t{header.points};
  } else if (std::isfinite(header.thickness) && header.thickness > 0) {
    shape.radius.assign(count, header.thickness / 2);
  }

  const bool tinted =
      is_finite(header.color) && header.color != vec3{1, 1, 1} && header.color != vec3{0, 0, 0};
  if ((header.flags & (has_transparency | has_colors)) != 0 || tinted) {
    shape.colors.assign(count, vec4(tinted ? header.color : vec3{1, 1, 1}, 1.0f));
  }
  if (header.flags & has_transparency) {
    for (uint32_t i = 0; i < count; ++i) {
      const float transparency = get_f32(bytes, at + 4 * uint64_t{i});
      shape.colors[i].w = transparency >= 0 ? 1 - std::min(transparency, 1.0f) : 1;
    }
    at += 4 * uint64_t{header.points};
  }
  if (header.flags & has_colors) {
    for (uint32_t i = 0; i < count; ++i) {
      const vec3 color = get_vec3(bytes, at + 12 * uint64_t{i});
      if (is_finite(color)) shape.colors[i] = vec4(color, shape.colors[i].w);
    }
  }
  return shape;
}

std::string write_hair(const shape_data& shape, const std::string& file, warning_list& warnings) {
  if (strand_count(shape) == 0) {
    throw file_error(file, "",
                     "a .hair file holds strands and the shape has none; .ply holds "
                     "faces and points");
  }
  const uint32_t per_piece = shape.basis == curve_basis::bezier ? 6 : 3;
  std::vector<uint32_t> counts;
  std::vector<strand_sample> samples;
  std::size_t left_out = 0;
  for (std::size_t k = 0; k < strand_count(shape); ++k) {
    const auto strand = sample_strand(shape, k, per_piece);
    if (strand.size() > 65536) {
      throw file_error(file, fmt::format("strand {}", k),
                       fmt::format("has {} points, but the .hair format ends at 65536 a strand; "
                                   ".ply holds longer ones",
                                   strand.size()));
    }
    if (strand.empty()) {
      ++left_out;
      continue;
    }
    counts.push_back(static_cast<uint32_t>(strand.size()));
    samples.insert(samples.end(), strand.begin(), strand.end());
  }
  if (samples.size() > 0xffffffffu) {
    throw file_error(file, "", "the shape has more points than the format can count (2^32)");
  }
  if (left_out != 0) {
    warnings.push_back(
        fmt::format("{}: {} strands without a curve piece were left out", file, left_out));
  }
  if (shape.basis != curve_basis::linear) {
    warnings.push_back(
        fmt::format("{}: the format holds straight segments only; curves were cut "
                    "into {} segments a piece",
                    file, per_piece));
  }

  if (!shape.roughness.empty()) {
    warnings.push_back(fmt::format(
        "{}: the format has no roughness of points; it was left out; .ply can hold it", file));
  }

  const bool same =
      std::adjacent_find(counts.begin(), counts.end(), std::not_equal_to<>()) == counts.end();
  const bool transparent =
      std::any_of(shape.colors.begin(), shape.colors.end(), [](const vec4& c) { return c.w != 1; });
  const uint32_t flags =
      (same ? 0u : has_segments) | has_points | (shape.radius.empty() ? 0u : has_thickness) |
      (transparent ? has_transparency : 0u) | (shape.colors.empty() ? 0u : has_colors);
  std::string out = "HAIR";
  put_u32(out, static_cast<uint32_t>(counts.size()));
  put_u32(out, static_cast<uint32_t>(samples.size()));
  put_u32(out, flags);
  put_u32(out, same && !counts.empty() ? counts[0] - 1 : 0);
  put_f32(out, 0);
  put_f32(out, 0);
  put_vec3(out, {1, 1, 1});
  out += "written by wisp";
  out.resize(header_size, '\0');

  if (!same) {
    for (uint32_t count : counts) put_u16(out, static_cast<uint16_t>(count - 1));
  }
  for (const auto& s : samples) put_vec3(out, blend<vec3>(shape.positions, s));
  if (!shape.radius.empty()) {
    for (const auto& s : samples) put_f32(out, 2 * blend<float>(shape.radius, s));
  }
  if (transparent) {
    for (const auto& s : samples) put_f32(out, 1 - blend<vec4>(shape.colors, s).w);
  }
  if (!shape.colors.empty()) {
    for (const auto& s : samples) put_vec3(out, vec3(blend<vec4>(shape.colors, s)));
  }
  return out;
}

}  // namespace wisp
