// AMD TressFX hair: the binary .tfx of TressFX 4 (TressFXFileFormat.h, 2017) and
// 3 (2016), and the text .tfx of TressFX 1 and 2.
//
// Binary, little endian: f32 version, u32 strands, u32 points per strand; then
// in version 4 the byte offsets of positions (4 f32, w = inverse mass), strand
// texture coordinates (2 f32), point texture coordinates (2 f32), strand
// thickness (f32) and point colours (4 f32), 160 bytes with the reserved ones;
// version 3 has positions of 3 f32 and its offsets from byte 144. An offset of
// 0 means that there is no such array.
//
// Thickness is read and written as the diameter of the fibre at the root, the
// same all along the strand: radius = thickness / 2.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hair_bytes.h"
#include "shape_formats.h"
#include "strand_sampling.h"
#include "text_cursor.h"

namespace wisp {

namespace {

constexpr uint64_t header_size_4 = 160, header_size_3 = 296;

struct tfx_layout {
  uint32_t strands = 0, points = 0;  // points of each strand
  uint32_t positions = 0, strand_texcoords = 0, point_texcoords = 0, thickness = 0, colors = 0;
  uint32_t position_size = 16;
};

tfx_layout read_layout(std::span<const uint8_t> bytes, const std::string& file) {
  const float version = bytes.size() >= 4 ? get_f32(bytes, 0) : 0;
  const bool is_4 = version >= 4 && version < 5, is_3 = version >= 3 && version < 4;
  if (!is_4 && !is_3) {
    throw file_error(file, "byte 0",
                     "is no .tfx file of TressFX 3 or 4 (it would begin with the "
                     "number 3 or 4 as a float) and no text of TressFX 2 (it "
                     "would begin with numStrands)");
  }
  const uint64_t header_size = is_4 ? header_size_4 : header_size_3;
  if (bytes.size() < header_size) {
    throw file_error(file, "",
                     fmt::format("is {} bytes long, but the header of a .tfx file of "
                                 "version {} has {}; is the file cut short?",
                                 bytes.size(), version, header_size));
  }
  tfx_layout l;
  l.strands = get_u32(bytes, 4);
  l.points = get_u32(bytes, 8);
  if (is_4) {
    l.positions = get_u32(bytes, 12);
    l.strand_texcoords = get_u32(bytes, 16);
    l.point_texcoords = get_u32(bytes, 20);
    l.thickness = get_u32(bytes, 24);
    l.colors = get_u32(bytes, 28);
  } else {
    l.position_size = 12;
    l.positions = get_u32(bytes, 144);
    l.thickness = get_u32(bytes, 148);
    l.strand_texcoords = get_u32(bytes, 152);
    l.colors = get_u32(bytes, 156);
    l.point_texcoords = get_u32(bytes, 164);
  }
  if (l.positions < header_size) {
    throw file_error(file, "header",
                     fmt::format("says that positions begin at byte {}, inside "
                                 "the header of {} bytes",
                                 l.positions, header_size));
  }
  if (l.strands != 0 && l.points < 2) {
    throw file_error(file, "byte 8",
                     fmt::format("says that a strand has {} points; it needs 2", l.points));
  }
  return l;
}

// Throws unless an array that the header names lies within the file.
void require_array(std::span<const uint8_t> bytes, const std::string& file, const char* what,
                   uint64_t at, uint64_t count, uint64_t size) {
  // strands * points may have up to 64 bits
  if (count <= 0xffffffffu && holds(bytes, at, count, size)) return;
  throw file_error(file, "header",
                   fmt::format("announces {} {} of {} bytes from byte {}, but the "
                               "file has {} bytes; is it cut short?",
                               count, what, size, at, bytes.size()));
}

shape_data read_binary_tfx(std::span<const uint8_t> bytes, const std::string& file,
                           warning_list& warnings) {
  const tfx_layout l = read_layout(bytes, file);
  const uint64_t count = uint64_t{l.strands} * l.points;
  require_array(bytes, file, "positions", l.positions, count, l.position_size);
  shape_data shape;
  shape.basis = curve_basis::linear;
  shape.strands.reserve(std::size_t{l.strands} + 1);
  for (uint32_t k = 0; k <= l.strands; ++k) shape.strands.push_back(k * l.points);
  shape.positions.resize(count);
  for (uint64_t i = 0; i < count; ++i) {
    shape.positions[i] = get_vec3(bytes, l.positions + i * l.position_size);
  }

  if (l.point_texcoords != 0) {
    require_array(bytes, file, "point texture coordinates", l.point_texcoords, count, 8);
  } else if (l.strand_texcoords != 0) {
    require_array(bytes, file, "strand texture coordinates", l.strand_texcoords, l.strands, 8);
  }
  if (l.point_texcoords != 0 || l.strand_texcoords != 0) {
    shape.texcoords.resize(count);
    for (uint64_t i = 0; i < count; ++i) {
      const uint64_t at = l.point_texcoords != 0 ? l.point_texcoords + 8 * i
                                                 : l.strand_texcoords + 8 * (i / l.points);
      shape.texcoords[i] = {get_f32(bytes, at), get_f32(bytes, at + 4)};
    }
  }
  if (l.thickness != 0) {
    require_array(bytes, file, "strand thicknesses", l.thickness, l.strands, 4);
    shape.radius.resize(count);
    std::size_t bad = 0;
    for (uint64_t i = 0; i < count; ++i) {
      const float thickness = get_f32(bytes, l.thickness + 4 * (i / l.points));
      const bool good = std::isfinite(thickness) && thickness >= 0;
      shape.radius[i] = good ? thickness / 2 : 0;
      bad += !good && i % l.points == 0;
    }
    if (bad != 0) {
      warnings.push_back(fmt::format(
          "{}: {} strands have a thickness that is negative or not finite; it was taken as 0", file,
          bad));
    }
  }
  if (l.colors != 0) {
    require_array(bytes, file, "colours", l.colors, count, 16);
    shape.colors.resize(count);
    for (uint64_t i = 0; i < count; ++i) {
      const uint64_t at = l.colors + 16 * i;
      shape.colors[i] = vec4(get_vec3(bytes, at), get_f32(bytes, at + 12));
    }
  }
  return shape;
}

// "numStrands N", "is sorted B", then for each strand "strand I numVerts M
// texcoord U V" and M lines of x y z.
shape_data read_text_tfx(std::span<const uint8_t> bytes, const std::string& file) {
  text_cursor text(bytes, file);
  shape_data shape;
  shape.basis = curve_basis::linear;
  shape.strands = {0};
  text.expect("numStrands");
  const uint64_t strands = text.count();
  bool texcoords = true;
  while (!text.at_end()) {
    const std::string_view key = text.word();
    if (key == "is") {
      text.expect("sorted");
      text.count();
    } else if (key == "strand") {
      text.count();
      text.expect("numVerts");
      const uint64_t points = text.count();
      vec2 uv = {0, 0};
      if (text.peek() == "texcoord") {
        text.word();
        uv.x = text.number();
        uv.y = text.number();
      } else {
        texcoords = false;
      }
      // the file is read to its end at most, so that a wrong count does no harm
      for (uint64_t i = 0; i < points; ++i) {
        vec3 p;
        for (int c = 0; c < 3; ++c) p[c] = text.number();
        shape.positions.push_back(p);
        shape.texcoords.push_back(uv);
      }
      shape.strands.push_back(static_cast<uint32_t>(shape.positions.size()));
    } else {
      text.fail(fmt::format("expected \"strand\", not \"{}\"", key));
    }
  }
  if (strand_count(shape) != strands) {
    text.fail(fmt::format("the file announces {} strands and has {}; is it cut short?", strands,
                          strand_count(shape)));
  }
  if (!texcoords) shape.texcoords.clear();
  return shape;
}

}  // namespace

shape_data read_tfx(std::span<const uint8_t> bytes, const std::string& file,
                    warning_list& warnings) {
  constexpr std::string_view text_magic = "numStrands";
  const bool is_text = bytes.size() >= text_magic.size() &&
                       std::equal(text_magic.begin(), text_magic.end(), bytes.begin(),
                                  [](char a, uint8_t b) { return static_cast<uint8_t>(a) == b; });
  return is_text ? read_text_tfx(bytes, file) : read_binary_tfx(bytes, file, warnings);
}

std::string write_tfx(const shape_data& shape, const std::string& file, warning_list& warnings) {
  const std::size_t strands = strand_count(shape);
  if (strands == 0) {
    throw file_error(file, "",
                     "a .tfx file holds strands and the shape has none; .ply holds "
                     "faces and points");
  }
  std::vector<strand_sample> samples;
  std::size_t points = 0;
  const uint32_t per_piece = shape.basis == curve_basis::bezier ? 3 : 1;
  for (std::size_t k = 0; k < strands; ++k) {
    const auto strand = sample_strand(shape, k, per_piece);
    if (k == 0) points = strand.size();
    if (strand.size() != points || points < 2) {
      throw file_error(file, fmt::format("strand {}", k),
                       fmt::format("has {} points and strand 0 has {}, but the strands of a .tfx "
                                   "file have one number of points, at least 2; .hair holds "
                                   "strands that differ",
                                   strand.size(), points));
    }
    samples.insert(samples.end(), strand.begin(), strand.end());
  }
  if (shape.basis != curve_basis::linear) {
    warnings.push_back(
        fmt::format("{}: the format holds straight segments only; {} were kept of each strand",
                    file, points - 1));
  }
  if (!shape.roughness.empty()) {
    warnings.push_back(fmt::format(
        "{}: the format has no roughness of points; it was left out; .ply can hold it", file));
  }
  if (points > 64 || (points & (points - 1)) != 0) {
    warnings.push_back(
        fmt::format("{}: strands have {} points; TressFX itself wants 4, 8, 16, 32 "
                    "or 64",
                    file, points));
  }
  uint64_t at = header_size_4;
  auto place = [&](bool wanted, uint64_t size) {
    const uint64_t here = at;
    if (!wanted) return uint64_t{0};
    at = (at + size + 7) & ~uint64_t{7};  // arrays begin at multiples of 8
    return here;
  };
  const uint64_t positions = place(true, 16 * uint64_t{samples.size()});
  const uint64_t texcoords = place(!shape.texcoords.empty(), 8 * uint64_t{strands});
  const uint64_t thickness = place(!shape.radius.empty(), 4 * uint64_t{strands});
  const uint64_t colors = place(!shape.colors.empty(), 16 * uint64_t{samples.size()});
  if (at > 0xffffffffu) {
    throw file_error(file, "", "the shape needs more than the 4 GiB that a .tfx file can have");
  }

  std::string out;
  put_f32(out, 4);
  put_u32(out, static_cast<uint32_t>(strands));
  put_u32(out, static_cast<uint32_t>(points));
  for (uint64_t offset : {positions, texcoords, uint64_t{0}, thickness, colors}) {
    put_u32(out, static_cast<uint32_t>(offset));
  }
  out.resize(header_size_4, '\0');
  for (std::size_t i = 0; i < samples.size(); ++i) {
    put_vec3(out, blend<vec3>(shape.positions, samples[i]));
    put_f32(out, i % points < 2 ? 0.0f : 1.0f);  // TressFX pins the first two points
  }
  if (texcoords != 0) {
    for (std::size_t k = 0; k < strands; ++k) {
      const vec2 uv = blend<vec2>(shape.texcoords, samples[k * points]);
      put_f32(out, uv.x);
      put_f32(out, uv.y);
    }
  }
  out.resize(thickness != 0 ? thickness : out.size(), '\0');
  if (thickness != 0) {
    bool tapered = false;
    for (std::size_t k = 0; k < strands; ++k) {
      const float root = blend<float>(shape.radius, samples[k * points]);
      tapered = tapered || blend<float>(shape.radius, samples[(k + 1) * points - 1]) != root;
      put_f32(out, 2 * root);
    }
    if (tapered) {
      warnings.push_back(
          fmt::format("{}: the format holds one thickness a strand; that of the "
                      "root was kept",
                      file));
    }
  }
  out.resize(colors != 0 ? colors : at, '\0');
  if (colors != 0) {
    for (const auto& s : samples) {
      const vec4 color = blend<vec4>(shape.colors, s);
      put_vec3(out, vec3(color));
      put_f32(out, color.w);
    }
    out.resize(at, '\0');
  }
  return out;
}

}  // namespace wisp
