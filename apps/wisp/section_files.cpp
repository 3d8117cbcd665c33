// Sections as files. For .vti see the VTK file formats,
// https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html: image data with
// appended raw arrays and 64-bit sizes before them.

#include "section_files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <limits>
#include <stdexcept>
#include <system_error>

#include "render_component.h"
#include "section_images.h"

namespace fs = std::filesystem;

namespace {

std::string extension_of(const fs::path& path) {
  std::string extension = path.extension().string();
  for (auto& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

std::size_t cell_count(const section_image& s) {
  return static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height);
}

void check_section(const section_image& s, const section_style& style) {
  auto check = [](bool good, const char* what) {
    if (!good) throw std::invalid_argument(what);
  };
  check(s.width > 0 && s.height > 0, "a section to save has no cells");
  check(s.channels >= 1 && s.channels <= 4, "a section to save has 1 to 4 channels");
  const std::size_t cells = cell_count(s), all = cells * static_cast<std::size_t>(s.channels);
  check(s.value.size() == all, "a section to save has another number of values than cells");
  check(s.error.empty() || s.error.size() == all,
        "a section to save has another number of errors than values");
  check(s.steps.empty() || s.steps.size() == cells,
        "a section to save has another number of steps than cells");
  check(s.distance.empty() || s.distance.size() == cells,
        "a section to save has another number of distances than cells");
  check(std::isfinite(s.cell) && s.cell > 0, "a section to save has cells without a size");
  if (style.range)
    check(std::isfinite(style.range->x) && std::isfinite(style.range->y) &&
              style.range->x < style.range->y,
          "the range of colours must be two numbers, the lesser first");
}

std::string triple(const wisp::dvec3& v) { return fmt::format("{} {} {}", v.x, v.y, v.z); }

// Writes beside, then renames.
void write_beside(const fs::path& path, const std::function<bool(std::FILE*)>& body) {
  const auto beside = path.parent_path() / fmt::format(".wisp-{}-section.tmp", getpid());
  auto fail = [&](const std::string& reason) {
    std::error_code ignored;
    fs::remove(beside, ignored);
    throw wisp::file_error(path.string(), "", "cannot be written: " + reason);
  };
  auto last_error = [] { return std::generic_category().message(errno ? errno : EIO); };
  errno = 0;
  std::FILE* file = std::fopen(beside.c_str(), "wb");
  if (!file) fail(last_error());
  const bool written = body(file);
  const auto reason = last_error();
  if (const bool closed = std::fclose(file) == 0; !written || !closed)
    fail(written ? last_error() : reason);
  std::error_code error;
  fs::rename(beside, path, error);
  if (error) fail(error.message());
}

std::string xml_text(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '-')  // two of them would end a comment
      result += "\u2010";
    else if (static_cast<unsigned char>(c) >= 0x20)
      result += c;
  }
  return result;
}

void save_vti(const fs::path& path, const section_image& s, const section_style& style) {
  // Points are the centers of cells, rows from the bottom up, so that the axes right,
  // up and normal are right-handed.
  const wisp::dvec3 up = -s.down;
  const wisp::dvec3 origin = s.corner + s.cell * (0.5 * s.right + (s.height - 0.5) * s.down);
  const auto w = static_cast<std::size_t>(s.width), h = static_cast<std::size_t>(s.height);
  const std::size_t cells = cell_count(s);
  struct array {
    std::string name;
    const std::vector<double>* data;  // null: the mask
    std::size_t components;
  };
  std::vector<array> arrays;
  auto add = [&](const char* name, const std::vector<double>& data) {
    if (!data.empty()) arrays.push_back({name, &data, data.size() / cells});
  };
  add("value", s.value);
  add("error", s.error);
  add("steps", s.steps);
  arrays.push_back({"inside", nullptr, 1});

  std::string head = "<?xml version=\"1.0\"?>\n";
  if (!style.title.empty()) head += "<!-- " + xml_text(style.title) + " -->\n";
  head += fmt::format(
      "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"{}\" header_type=\"UInt64\">\n",
      std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian");
  // Direction is a matrix by rows; its columns are the axes
  const wisp::dvec3 &a = s.right, &b = up, &c = s.normal;
  const auto extent = fmt::format("0 {} 0 {} 0 0", s.width - 1, s.height - 1);
  head += fmt::format(
      "  <ImageData WholeExtent=\"{}\" Origin=\"{}\" Spacing=\"{} {} {}\"\n"
      "    Direction=\"{} {} {} {} {} {} {} {} {}\">\n    <Piece Extent=\"{}\">\n"
      "      <PointData Scalars=\"value\">\n",
      extent, triple(origin), s.cell, s.cell, s.cell, a.x, b.x, c.x, a.y, b.y, c.y, a.z, b.z, c.z,
      extent);
  std::size_t offset = 0;
  for (const auto& array : arrays) {
    head += fmt::format(
        "        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" "
        "offset=\"{}\"/>\n",
        array.data ? "Float64" : "UInt8", array.name, array.components, offset);
    offset += 8 + cells * array.components * (array.data ? 8 : 1);
  }
  head +=
      "      </PointData>\n      <CellData/>\n    </Piece>\n  </ImageData>\n"
      "  <AppendedData encoding=\"raw\">\n_";

  write_beside(path, [&](std::FILE* file) {
    auto put = [&](const void* data, std::size_t size) {
      return std::fwrite(data, 1, size, file) == size;
    };
    bool good = put(head.data(), head.size());
    for (const auto& array : arrays) {
      const std::uint64_t bytes = cells * array.components * (array.data ? 8 : 1);
      good = good && put(&bytes, sizeof(bytes));
      std::vector<double> row(w * array.components);
      std::vector<std::uint8_t> mask(w);
      for (std::size_t y = h; good && y-- > 0;) {
        for (std::size_t x = 0; x < w; x++) {
          mask[x] = std::isnan(s.value[y * w + x]) ? 0 : 1;
          for (std::size_t k = 0; array.data && k < array.components; k++)
            row[x * array.components + k] = (*array.data)[k * cells + y * w + x];
        }
        good = array.data ? put(row.data(), row.size() * sizeof(double)) : put(mask.data(), w);
      }
    }
    static constexpr char tail[] = "\n  </AppendedData>\n</VTKFile>\n";
    return good && put(tail, sizeof(tail) - 1);
  });
}

}  // namespace

wisp::dvec2 default_range(const section_image& section, wisp::section_colors colormap) {
  std::vector<double> values;
  for (const double v : section.value)
    if (std::isfinite(v)) values.push_back(v);
  if (values.empty()) return {0, 1};
  std::sort(values.begin(), values.end());
  double low = values.front(), high = values.back();
  // a few far from the rest
  const auto cut = static_cast<std::size_t>(0.005 * static_cast<double>(values.size()));
  const double first = values[cut], last = values[values.size() - 1 - cut];
  const double most = 0.5 * (last - first);
  if (last > first && first - low > most) low = first;
  if (last > first && high - last > most) high = last;
  if (colormap == wisp::section_colors::coolwarm && low < 0 && high > 0) {
    high = std::max(-low, high);
    low = -high;
  }
  // one value, or all that rounding leaves of one
  const double size = std::max(std::abs(low), std::abs(high));
  if (!(high - low > 1e-9 * size)) {
    const double middle = low / 2 + high / 2, half = size > 0 ? size / 2 : 0.5;
    return {std::max(middle - half, std::numeric_limits<double>::lowest()),
            std::min(middle + half, std::numeric_limits<double>::max())};
  }
  return {low, high};
}

void save_section(const fs::path& path, const section_image& section, const section_style& style) {
  check_section_output(path);
  check_section(section, style);
  const auto extension = extension_of(path);
  try {
    if (extension == ".vti") {
      save_vti(path, section, style);
    } else if constexpr (has_render) {
      save_section_image(path, section, style);
    }
  } catch (const std::bad_alloc&) {
    throw wisp::file_error(path.string(), "", "not enough memory to write the section");
  }
}

bool is_section_image(const fs::path& path) {
  const auto extension = extension_of(path);
  return extension == ".png" || extension == ".exr";
}

bool can_save_section(const fs::path& path) {
  return extension_of(path) == ".vti" || (has_render && is_section_image(path));
}

void check_section_output(const fs::path& path) {
  if (!has_render && is_section_image(path))
    throw wisp::file_error(path.string(), "", needs_render("is an image, which"));
  if (!can_save_section(path))
    throw wisp::file_error(path.string(), "",
                           has_render ? "sections are written as .png, .exr or .vti; the name must "
                                        "end in one of them"
                                      : "sections are written as .vti; the name must end in that");
  if constexpr (has_render) {
    if (is_section_image(path)) {
      check_section_image(path);
      return;
    }
  }
  std::error_code error;
  const auto folder = path.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, error))
    throw wisp::file_error(path.string(), "", "the folder " + folder.string() + " does not exist");
  if (fs::is_directory(path, error))
    throw wisp::file_error(path.string(), "", "is a folder, where a file is to be written");
  // whether there is a right to write, without leaving anything
  const auto beside = folder / fmt::format(".wisp-{}-section.tmp", getpid());
  errno = 0;
  std::FILE* file = std::fopen(beside.c_str(), "wb");
  if (!file)
    throw wisp::file_error(path.string(), "",
                           "cannot be written: " + std::generic_category().message(errno));
  std::fclose(file);
  fs::remove(beside, error);
}
