#include "section_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "colormap.h"
#include "section_picture.h"
#include "wisp/render/image.h"

namespace fs = std::filesystem;

namespace {

std::size_t cell_count(const section_image& s) {
  return static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height);
}

std::string triple(const wisp::dvec3& v) { return fmt::format("{} {} {}", v.x, v.y, v.z); }

// Channels of a file: their names and planes.
struct named_plane {
  std::string name;
  const double* data;
};

std::vector<named_plane> list_planes(const section_image& s) {
  std::vector<named_plane> planes;
  auto add = [&](const std::string& name, const std::vector<double>& data) {
    static constexpr const char* letters[] = {"R", "G", "B", "A"};
    const std::size_t n = data.size() / cell_count(s);
    for (std::size_t c = 0; c < n; c++)
      planes.push_back({s.channels > 1 && n > 1 ? name + "." + letters[c] : name,
                        data.data() + c * cell_count(s)});
  };
  add("value", s.value);
  add("error", s.error);
  add("steps", s.steps);
  return planes;
}

void save_exr(const fs::path& path, const section_image& s, const section_style& style) {
  wisp::image_data image;
  image.width = s.width, image.height = s.height;
  const auto planes = list_planes(s);
  for (const auto& plane : planes) image.channels.push_back(plane.name);
  // viewers choke on NaN, which becomes 0: this tells where there is a value
  image.channels.push_back("inside");
  const std::size_t n = image.channels.size();
  image.pixels.resize(cell_count(s) * n);
  constexpr double most = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < cell_count(s); i++) {
    for (std::size_t c = 0; c + 1 < n; c++) {
      const double v = planes[c].data[i];
      image.pixels[i * n + c] =
          static_cast<float>(std::isfinite(v) ? std::clamp(v, -most, most) : v);
    }
    image.pixels[i * n + n - 1] = std::isnan(s.value[i]) ? 0.0f : 1.0f;
  }
  image.metadata = style.metadata;
  if (!style.title.empty()) image.metadata.emplace_back("ImageDescription", style.title);
  image.metadata.emplace_back("wisp:section:corner", triple(s.corner));
  image.metadata.emplace_back("wisp:section:right", triple(s.right));
  image.metadata.emplace_back("wisp:section:down", triple(s.down));
  image.metadata.emplace_back("wisp:section:cell", fmt::format("{}", s.cell));
  wisp::save_image(path, image);
}

void save_png(const fs::path& path, const section_image& s, const section_style& style) {
  const canvas picture = draw_section(s, style);
  wisp::image_data image;
  image.width = picture.width, image.height = picture.height;
  image.channels = {"R", "G", "B"};
  image.pixels.reserve(picture.pixels.size() * 3);
  for (const wisp::vec3& color : picture.pixels)
    for (int c = 0; c < 3; c++) image.pixels.push_back(srgb_to_linear(color[c]));
  image.metadata = style.metadata;
  if (!style.title.empty()) image.metadata.emplace_back("ImageDescription", style.title);
  wisp::image_write_options options;
  options.filmic = false;
  wisp::save_image(path, image, options);
}

}  // namespace

void save_section_image(const fs::path& path, const section_image& section,
                        const section_style& style) {
  std::string extension = path.extension().string();
  for (auto& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".exr")
    save_exr(path, section, style);
  else
    save_png(path, section, style);
}

void check_section_image(const fs::path& path) { wisp::check_image_output(path); }
