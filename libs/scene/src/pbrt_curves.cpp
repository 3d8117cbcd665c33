// The curves of pbrt scenes, versions 3 and 4, and writing them in version 4.
// https://pbrt.org/fileformat-v3#shapes-curve, https://pbrt.org/fileformat-v4;
// what a curve's parameters mean: Pharr, Jakob, Humphreys, Physically Based
// Rendering, 4th edition, section 6.7. Bezier and B-spline forms: Farin, Curves
// and Surfaces for CAGD, 5th edition.
//
// Widths run linearly from width0 to width1 over the parameter of the whole
// curve; radius = width / 2. All conversions are exact.

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <map>

#include "pbrt_tokens.h"
#include "shape_formats.h"
#include "strand_sampling.h"

namespace wisp {

namespace {

using glm::dmat4;

// Bounds what object instances may multiply.
constexpr std::size_t max_points = 200'000'000;

// Strands of one basis each, in the order of the file.
struct curve_list {
  std::vector<dvec4> points = {};  // xyz and radius
  std::vector<std::size_t> ends = {};
  std::vector<curve_basis> basis = {};
  std::size_t flat = 0, round = 0;  // counts of each profile
  bool joinable = false;            // the next curve may continue the last one
};

struct reader {
  pbrt_tokens& tokens;
  warning_list& warnings;
  dmat4 transform = dmat4(1);
  std::vector<dmat4> stack = {};
  std::map<std::string, dmat4> systems = {};
  curve_list curves = {};
  std::map<std::string, curve_list> objects = {};
  std::optional<std::string> object = {};  // between ObjectBegin and ObjectEnd
  std::size_t other_shapes = 0, ribbons = 0, stretched = 0, bad_widths = 0;
};

// --- Transformations --------------------------------------------------------

// pbrt writes the columns of a matrix one after the other.
dmat4 read_matrix(pbrt_tokens& tokens) {
  const std::vector<double> m = tokens.numbers(16);
  dmat4 result;
  for (int i = 0; i < 16; ++i) result[i / 4][i % 4] = m[static_cast<std::size_t>(i)];
  if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) {
    tokens.fail(
        "the transformation is not affine; numbers 4, 8, 12 should be 0 and 16 should be 1");
  }
  return result;
}

dmat4 translation(const dvec3& t) {
  dmat4 m(1);
  m[3] = dvec4(t, 1);
  return m;
}

dmat4 scaling(const dvec3& s) {
  dmat4 m(1);
  for (int i = 0; i < 3; ++i) m[i][i] = s[i];
  return m;
}

// Rodrigues' formula; a zero axis rotates nothing.
dmat4 rotation_about(double degrees, dvec3 axis) {
  const double length = glm::length(axis);
  if (!(length > 0) || !std::isfinite(length)) return dmat4(1);
  axis /= length;
  const double angle = degrees * 3.14159265358979323846 / 180;
  const double s = std::sin(angle), c = std::cos(angle);
  dmat4 m(1);
  for (int i = 0; i < 3; ++i) {
    dvec3 e(0);
    e[i] = 1;
    m[i] = dvec4(c * e + s * glm::cross(axis, e) + (1 - c) * glm::dot(axis, e) * axis, 0);
  }
  return m;
}

// The transformation from the world to a camera at `eye`; pbrt's cameras look
// along +z with x to the right, a left-handed system.
dmat4 look_at(const dvec3& eye, const dvec3& target, const dvec3& up, const pbrt_tokens& tokens) {
  const dvec3 forward = target - eye;
  const dvec3 right = glm::cross(up, forward);
  if (!(glm::dot(right, right) > 0)) tokens.fail("LookAt looks along its up vector");
  const dvec3 z = glm::normalize(forward), x = glm::normalize(right), y = glm::cross(z, x);
  return glm::inverse(dmat4(dvec4(x, 0), dvec4(y, 0), dvec4(z, 0), dvec4(eye, 1)));
}

// How much a transformation scales lengths, on average over directions.
double length_scale(const dmat4& m) {
  const dvec3 x(m[0]), y(m[1]), z(m[2]);
  return std::cbrt(std::abs(glm::dot(glm::cross(x, y), z)));
}

bool is_stretched(const dmat4& m, double scale) {
  for (int i = 0; i < 3; ++i) {
    if (std::abs(glm::length(dvec3(m[i])) - scale) > 1e-3 * scale) return true;
  }
  return false;
}

dvec4 transform_control_point(const dmat4& m, double scale, const dvec4& p) {
  return dvec4(dvec3(m * dvec4(dvec3(p), 1)), p.w * scale);
}

// --- Curves -----------------------------------------------------------------

// A quadratic Bezier piece as a cubic one (degree elevation).
void append_elevated(std::vector<dvec4>& out, const dvec4& a, const dvec4& b, const dvec4& c) {
  if (out.empty()) out.push_back(a);
  out.push_back(a + (b - a) * (2.0 / 3));
  out.push_back(c + (b - c) * (2.0 / 3));
  out.push_back(c);
}

// Uniform cubic B-spline to Bezier pieces.
std::vector<dvec4> bspline_to_bezier(std::span<const dvec4> p) {
  std::vector<dvec4> out = {(p[0] + 4.0 * p[1] + p[2]) / 6.0};
  for (std::size_t i = 0; i + 3 < p.size(); ++i) {
    out.push_back((2.0 * p[i + 1] + p[i + 2]) / 3.0);
    out.push_back((p[i + 1] + 2.0 * p[i + 2]) / 3.0);
    out.push_back((p[i + 1] + 4.0 * p[i + 2] + p[i + 3]) / 6.0);
  }
  return out;
}

struct cubic_curve {
  curve_basis basis = curve_basis::bezier;
  std::vector<dvec4> points = {};
};

// Sets the radii of control points at parameters (i - first) / pieces.
void set_radii(std::vector<dvec4>& points, double first, double spans, double r0, double r1) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double t = (static_cast<double>(i) - first) / spans;
    points[i].w = r0 * (1 - t) + r1 * t;
  }
}

// Any of pbrt's four kinds of curve as a cubic one.
cubic_curve make_cubic(std::vector<dvec4> p, bool bspline, bool quadratic, double r0, double r1) {
  cubic_curve curve;
  if (bspline && !quadratic) {
    // control value i belongs to parameter i - 1 of n - 3 (its Greville abscissa)
    set_radii(p, 1, static_cast<double>(p.size() - 3), r0, r1);
    if (p.front().w >= 0 && p.back().w >= 0) {
      curve.basis = curve_basis::bspline;
      curve.points = std::move(p);
    } else {  // a radius below 0 outside the curve is no radius: the Bezier form has none
      curve.points = bspline_to_bezier(p);
    }
  } else if (bspline) {
    for (std::size_t i = 0; i + 2 < p.size(); ++i) {
      append_elevated(curve.points, (p[i] + p[i + 1]) / 2.0, p[i + 1], (p[i + 1] + p[i + 2]) / 2.0);
    }
  } else if (quadratic) {
    for (std::size_t i = 0; i + 2 < p.size(); i += 2) {
      append_elevated(curve.points, p[i], p[i + 1], p[i + 2]);
    }
  } else {
    curve.points = std::move(p);
  }
  if (curve.basis == curve_basis::bezier) {
    set_radii(curve.points, 0, static_cast<double>(curve.points.size() - 1), r0, r1);
  }
  return curve;
}

bool same_in_float(const dvec4& a, const dvec4& b) { return vec4(a) == vec4(b); }

void append_curve(reader& r, curve_list& list, std::span<const dvec4> points, curve_basis basis) {
  if (list.points.size() + points.size() > max_points) {
    r.tokens.fail(fmt::format("the curves have more than {} points", max_points));
  }
  // Hair is often written as one Shape for each Bezier piece.
  const bool join = list.joinable && basis == curve_basis::bezier &&
                    list.basis.back() == curve_basis::bezier &&
                    same_in_float(list.points.back(), points[0]);
  list.points.insert(list.points.end(), points.begin() + (join ? 1 : 0), points.end());
  if (join) {
    list.ends.back() = list.points.size();
  } else {
    list.ends.push_back(list.points.size());
    list.basis.push_back(basis);
  }
  list.joinable = true;
}

void read_curve(reader& r) {
  std::vector<dvec4> points;
  std::string type = "flat", basis = "bezier";
  double degree = 3, width = 1;
  std::optional<double> width0, width1;
  for (const pbrt_parameter& p : r.tokens.parameters()) {
    const double first = p.numbers.empty() ? 0 : p.numbers[0];
    if (p.name == "P" && (p.type == "point" || p.type == "point3")) {
      if (p.numbers.size() % 3 != 0)
        r.tokens.fail("P of a curve has a point of less than 3 numbers");
      for (std::size_t i = 0; i < p.numbers.size(); i += 3) {
        points.push_back(dvec4(p.numbers[i], p.numbers[i + 1], p.numbers[i + 2], 0));
      }
    } else if (p.type == "string" && !p.texts.empty() && p.name == "type") {
      type = p.texts[0];
    } else if (p.type == "string" && !p.texts.empty() && p.name == "basis") {
      basis = p.texts[0];
    } else if (p.type == "integer" && p.name == "degree") {
      degree = first;
    } else if (p.type == "float" && p.name == "width") {
      width = first;
    } else if (p.type == "float" && p.name == "width0") {
      width0 = first;
    } else if (p.type == "float" && p.name == "width1") {
      width1 = first;
    }
  }

  if (type != "flat" && type != "cylinder" && type != "ribbon") {
    r.tokens.fail(
        fmt::format("the type of a curve is \"{}\"; it should be flat, cylinder or ribbon",
                    type.substr(0, 40)));
  }
  if (basis != "bezier" && basis != "bspline") {
    r.tokens.fail(fmt::format("the basis of a curve is \"{}\"; it should be bezier or bspline",
                              basis.substr(0, 40)));
  }
  if (degree != 2 && degree != 3) r.tokens.fail("the degree of a curve should be 2 or 3");
  const bool bspline = basis == "bspline", quadratic = degree == 2;
  const std::size_t order = quadratic ? 3 : 4;
  if (points.size() < order || (!bspline && (points.size() - 1) % (order - 1) != 0)) {
    r.tokens.fail(fmt::format(
        "a curve has {} points; a {} curve of degree {} wants {}", points.size(), basis, degree,
        bspline ? fmt::format("at least {}", order) : fmt::format("{} n + 1", order - 1)));
  }
  auto radius = [&](double w) {
    if (std::isfinite(w) && w >= 0) return w / 2;
    ++r.bad_widths;
    return 0.0;
  };
  r.ribbons += type == "ribbon";

  cubic_curve curve = make_cubic(std::move(points), bspline, quadratic,
                                 radius(width0.value_or(width)), radius(width1.value_or(width)));
  const double scale = length_scale(r.transform);
  r.stretched += is_stretched(r.transform, scale);
  for (dvec4& p : curve.points) p = transform_control_point(r.transform, scale, p);
  curve_list& list = r.object ? r.objects[*r.object] : r.curves;
  append_curve(r, list, curve.points, curve.basis);
  ++(type == "cylinder" ? list.round : list.flat);
}

void read_instance(reader& r) {
  const std::string name = r.tokens.text();
  if (r.object) r.tokens.fail("ObjectInstance stands between ObjectBegin and ObjectEnd");
  const auto found = r.objects.find(name);
  if (found == r.objects.end()) return;  // an object without curves, or none
  const curve_list& object = found->second;
  const double scale = length_scale(r.transform);
  r.stretched += is_stretched(r.transform, scale);
  std::size_t begin = 0;
  for (std::size_t k = 0; k < object.ends.size(); ++k) {
    std::vector<dvec4> points(object.points.begin() + static_cast<std::ptrdiff_t>(begin),
                              object.points.begin() + static_cast<std::ptrdiff_t>(object.ends[k]));
    for (dvec4& p : points) p = transform_control_point(r.transform, scale, p);
    r.curves.joinable = false;  // the object's curves are joined already
    append_curve(r, r.curves, points, object.basis[k]);
    begin = object.ends[k];
  }
  r.curves.joinable = false;
  r.curves.flat += object.flat;
  r.curves.round += object.round;
}

// --- Directives -------------------------------------------------------------

bool read_transformation(reader& r, const std::string& directive) {
  pbrt_tokens& t = r.tokens;
  auto vector = [](const std::vector<double>& v, std::size_t i) {
    return dvec3(v[i], v[i + 1], v[i + 2]);
  };
  if (directive == "Identity") {
    r.transform = dmat4(1);
  } else if (directive == "Translate") {
    r.transform = r.transform * translation(vector(t.numbers(3), 0));
  } else if (directive == "Scale") {
    r.transform = r.transform * scaling(vector(t.numbers(3), 0));
  } else if (directive == "Rotate") {
    const auto v = t.numbers(4);
    r.transform = r.transform * rotation_about(v[0], vector(v, 1));
  } else if (directive == "LookAt") {
    const auto v = t.numbers(9);
    r.transform = r.transform * look_at(vector(v, 0), vector(v, 3), vector(v, 6), t);
  } else if (directive == "Transform") {
    r.transform = read_matrix(t);
  } else if (directive == "ConcatTransform") {
    r.transform = r.transform * read_matrix(t);
  } else if (directive == "CoordinateSystem") {
    r.systems[t.text()] = r.transform;
  } else if (directive == "CoordSysTransform") {
    const std::string name = t.text();
    const auto system = r.systems.find(name);
    if (system == r.systems.end()) {
      t.fail(fmt::format("there is no coordinate system \"{}\"", name.substr(0, 40)));
    }
    r.transform = system->second;
  } else {
    return false;
  }
  return true;
}

void read_directive(reader& r, const std::string& directive) {
  pbrt_tokens& t = r.tokens;
  if (read_transformation(r, directive)) return;
  if (directive == "Shape") {
    if (t.text() == "curve") {
      read_curve(r);
    } else {
      ++r.other_shapes;
      t.skip_arguments();
    }
  } else if (directive == "AttributeBegin" || directive == "TransformBegin") {
    r.stack.push_back(r.transform);
  } else if (directive == "AttributeEnd" || directive == "TransformEnd") {
    if (r.stack.empty()) t.fail(directive + " stands without its Begin");
    r.transform = r.stack.back();
    r.stack.pop_back();
  } else if (directive == "ObjectBegin") {
    if (r.object) t.fail("ObjectBegin stands within another object");
    r.object = t.text();
    r.stack.push_back(r.transform);
  } else if (directive == "ObjectEnd") {
    if (!r.object || r.stack.empty()) t.fail("ObjectEnd stands without ObjectBegin");
    r.object.reset();
    r.transform = r.stack.back();
    r.stack.pop_back();
  } else if (directive == "ObjectInstance") {
    read_instance(r);
  } else if (directive == "Camera") {
    r.systems["camera"] = glm::inverse(r.transform);
    t.skip_arguments();
  } else if (directive == "WorldBegin") {
    r.transform = dmat4(1);
    r.systems["world"] = r.transform;
  } else if (directive == "Include" || directive == "Import") {
    t.include(t.text());
  } else {
    t.skip_arguments();
  }
}

void warn(const reader& r, const std::string& file) {
  auto say = [&](std::size_t count, const char* text) {
    if (count != 0) r.warnings.push_back(fmt::format("{}: {} {}", file, count, text));
  };
  say(r.other_shapes, "shapes that are not curves were ignored");
  say(r.ribbons,
      "ribbons were taken as flat curves that turn to face each ray; their normals were "
      "ignored");
  say(r.stretched, "curves are stretched by their transformation; widths were scaled by its mean");
  say(r.bad_widths, "widths that are negative or not finite were taken as 0");
  if (!r.stack.empty()) say(r.stack.size(), "blocks are not closed at the end of the file");
  if (r.curves.flat != 0 && r.curves.round != 0) {
    r.warnings.push_back(fmt::format(
        "{}: has {} flat curves and {} cylinders; all were taken as {}", file, r.curves.flat,
        r.curves.round, r.curves.round > r.curves.flat ? "cylinders" : "flat"));
  }
}

shape_data make_shape(const curve_list& curves) {
  shape_data shape;
  shape.profile = curves.round > curves.flat ? curve_profile::round : curve_profile::flat;
  bool all_bspline = true;
  for (curve_basis b : curves.basis) all_bspline = all_bspline && b == curve_basis::bspline;
  shape.basis = all_bspline ? curve_basis::bspline : curve_basis::bezier;
  shape.strands = {0};
  std::size_t begin = 0;
  for (std::size_t k = 0; k < curves.ends.size(); ++k) {
    const std::span<const dvec4> strand(curves.points.data() + begin, curves.ends[k] - begin);
    auto append = [&](std::span<const dvec4> points) {
      for (const dvec4& p : points) {
        shape.positions.push_back(vec3(p));
        shape.radius.push_back(static_cast<float>(p.w));
      }
    };
    if (curves.basis[k] == shape.basis) {
      append(strand);
    } else {
      append(bspline_to_bezier(strand));
    }
    shape.strands.push_back(static_cast<uint32_t>(shape.positions.size()));
    begin = curves.ends[k];
  }
  return shape;
}

}  // namespace

shape_data read_pbrt_curves(std::span<const uint8_t> bytes, const std::string& file,
                            warning_list& warnings) {
  pbrt_tokens tokens(std::string(bytes.begin(), bytes.end()), file);
  reader r{tokens, warnings};
  while (tokens.peek().type != pbrt_token_type::end) {
    const pbrt_token token = tokens.next();
    if (token.type != pbrt_token_type::word) tokens.fail("expected a directive such as Shape");
    read_directive(r, token.text);
  }
  warn(r, file);
  if (r.curves.ends.empty()) {
    throw file_error(file, "",
                     fmt::format("has no Shape \"curve\"; of a .pbrt file only its curves "
                                 "are read ({} other shapes were found)",
                                 r.other_shapes));
  }
  return make_shape(r.curves);
}

}  // namespace wisp
