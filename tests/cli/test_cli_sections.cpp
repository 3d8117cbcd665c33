// Sections in pictures: wisp render solves them and shows solids cut open.

#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "run_command.h"
#include "wisp/render/image.h"

namespace {

float srgb_to_linear(float c) {
  return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
}

// u = x in, or around, a ball of radius 1 that is seen from +z by an orthographic camera of
// 3 by 3 units, and cut at z = 0.
std::string section_scene(const folder& f, const std::string& solid, const std::string& problem,
                          const std::string& section, const std::string& instance = "") {
  return f.write("section.json", R"({
    "cameras": [{"name": "c", "lookat": [0, 0, 5, 0, 0, 0, 0, 1, 0], "orthographic": true,
                 "lens": 1, "film": 3, "aspect": 1}],
    "shapes": [{"name": "cube", "uri": "cube.ply"}],
    "solids": [{"name": "ball", "sdf": {"sphere": {"radius": 1}}, "resolution": 64)" +
                                     solid + R"(}],
    "problems": [{"name": "p", "boundary": "x", "walks": 64)" +
                                     problem + R"(}],
    "sections": [{"name": "cut", "problem": "p", "colormap": "gray", "range": [-2, 2],
                  "contours": 0)" + section +
                                     R"(}],
    "instances": [{"section": "cut")" +
                                     instance + R"(}]
  })");
}

// A cube of side 2, whose faces are counter-clockwise from outside.
void write_cube(const folder& f) {
  f.write("cube.ply",
          "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
          "property float z\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n"
          "-1 -1 -1\n1 -1 -1\n1 1 -1\n-1 1 -1\n-1 -1 1\n1 -1 1\n1 1 1\n-1 1 1\n"
          "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
}

wisp::image_data render_scene_file(const folder& f, const std::string& scene) {
  const auto o = run({"render", scene, "-o", f / "a.exr", "--resolution", "48", "--samples", "8",
                      "--filter", "box", "--report", f / "r.json"});
  CAPTURE(o.err);
  REQUIRE(o.status == 0);
  return wisp::load_image(f / "a.exr");
}

// Red at a place of the plane z = 0.
float pixel_at(const wisp::image_data& image, double x, double y) {
  const auto i = static_cast<std::size_t>((x + 1.5) / 3 * 48);
  const auto j = static_cast<std::size_t>((1.5 - y) / 3 * 48);
  return image.pixels[(j * 48 + i) * image.channels.size()];
}
float gray_of(double value) { return srgb_to_linear(static_cast<float>((value + 2) / 4)); }

}  // namespace

TEST_CASE("cli: a picture shows a section of a solid with the colours of its solution") {
  folder f;
  write_cube(f);
  struct kind {
    std::string solid, problem;
  };
  const std::string ball = ", \"domain\": \"ball\"";
  for (const auto& k : {kind{"", ball}, kind{", \"display\": \"trace\"", ball},
                        kind{"", ", \"domain\": \"cube\""}}) {
    const auto image = render_scene_file(f, section_scene(f, k.solid, k.problem, ""));
    // between centers of pixels a solution that is linear is linear in sRGB
    for (const double x : {-0.75, -0.5, 0.0, 0.25, 0.7})
      for (const double y : {-0.4, 0.0, 0.5}) {
        const double center = (std::floor((x + 1.5) / 3 * 48) + 0.5) / 48 * 3 - 1.5;
        CAPTURE(k.solid);
        CAPTURE(k.problem);
        CAPTURE(x);
        CHECK(std::abs(pixel_at(image, x, y) - gray_of(center)) < 0.05f);
      }
    CHECK(pixel_at(image, 1.2, 1.2) == 0);  // no light, no sky
    const auto report = nlohmann::json::parse(read_file(f / "r.json"));
    bool found = false;
    for (const auto& part : report["parts"])
      if (part["name"] == "section textures") {
        found = true;
        CHECK(part["built"].get<bool>());
        CHECK(part["bytes"].get<double>() > 1000);
      }
    CHECK(found);
    CHECK(report["seconds"].contains("sections"));
  }
}

TEST_CASE("cli: sections stand where instances put them") {
  folder f;
  write_cube(f);
  // half the size, x and y exchanged, to the left
  const auto scene = section_scene(f, "", ", \"domain\": \"ball\"", "",
                                   R"(, "frame": [0, 0.5, 0, 0.5, 0, 0, 0, 0, -0.5, -0.5, 0, 0])");
  const auto image = render_scene_file(f, scene);
  CHECK(pixel_at(image, 0.6, 0) == 0);
  // from the other side the surface is seen: x of the ball is y of the picture
  for (const double y : {-0.35, 0.0, 0.3}) {
    const double center = (std::floor((1.5 - y) / 3 * 48) + 0.5) / 48 * -3 + 1.5;
    CHECK(std::abs(pixel_at(image, -0.5, y) - gray_of(2 * center)) < 0.03f);
  }
}

TEST_CASE("cli: a section of what is outside is a sheet around the solid") {
  folder f;
  write_cube(f);
  const auto image = render_scene_file(
      f, section_scene(f, "", R"(, "domain": "ball", "side": "exterior")", ", \"size\": 2.8"));
  for (const double x : {-0.5, 0.0, 0.5})
    CHECK(std::abs(pixel_at(image, x, 0) - gray_of(x)) < 0.02f);  // the ball
  for (const double x : {1.2, -1.2}) {
    const double r = std::hypot(1.2, x);
    CHECK(std::abs(pixel_at(image, x, 1.2) - gray_of(x / (r * r * r))) < 0.05f);
  }
  CHECK(pixel_at(image, 1.47, 0) == 0);
}

TEST_CASE("cli: sections without walks or domains are told of") {
  folder f;
  write_cube(f);
  const auto scene = section_scene(f, "", ", \"domain\": \"ball\"", ", \"origin\": [0, 0, 5]");
  auto o = run({"render", scene, "-o", f / "a.exr", "--resolution", "16"});
  CHECK(o.status == 1);
  CHECK(o.err.find("sections[0]") != std::string::npos);
  CHECK_FALSE(fs::exists(f.path / "a.exr"));
  o = run({"render", scene, "-o", f / "a.exr", "--walks", "0"});
  CHECK(o.status == 2);
  o = run({"info", scene});
  CHECK(o.status == 0);
  CHECK(o.out.find("section textures") != std::string::npos);
}
