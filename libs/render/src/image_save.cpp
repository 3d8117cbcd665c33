// Writing of images, and the tone curve of .png and .jpg. OpenEXR writes .exr;
// the others are encoded by the image module.
//
// A file is written under another name beside its place and renamed when it is
// complete, so that a reader never sees half of one.

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <memory>
#include <new>
#include <random>
#include <span>
#include <system_error>

#include "image_exr.h"
#include "image_module.h"

namespace wisp {

namespace fs = std::filesystem;

namespace {

float linear_to_srgb(float c) {
  if (c >= 1) return 1;
  return c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
}

// The curve for the brightest channel: the identity up to mid-grey, then the
// extended operator of Reinhard et al. (Photographic Tone Reproduction for
// Digital Images, 2002, equation 4) on what lies above, which meets it with
// slope one and reaches one at `white`.
float filmic_curve(float x) {
  constexpr float knee = 0.18f, white = 12.0f, range = 1 - knee;
  if (x <= knee) return x;
  if (x >= white) return 1;
  constexpr float w = (white - knee) / range;
  float t = (x - knee) / range;
  return std::min(1.0f, knee + range * t * (1 + t / (w * w)) / (1 + t));
}

// Scales all channels alike, so that hue stays, and lets what was compressed
// fade towards white (as the Khronos PBR neutral tone mapper of 2024 does):
// otherwise a bright red light would stay a flat red.
vec3 filmic(const vec3& rgb) {
  float peak = max_component(rgb);
  if (peak <= 0) return {0, 0, 0};
  constexpr float desaturation = 0.15f;
  float mapped = filmic_curve(peak);
  float whiten = 1 - 1 / (desaturation * (peak - mapped) + 1);
  return glm::mix(rgb * (mapped / peak), vec3{mapped}, whiten);
}

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (auto& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

// A file beside the wanted one that vanishes unless it is renamed. The ending
// stays, since it chooses the format; the rest is short, so that any name that
// the folder takes can be written.
struct pending_file {
  fs::path target = "";
  fs::path path = "";

  explicit pending_file(const fs::path& target_) : target(target_) {
    std::random_device random;
    path = target.parent_path() /
           fmt::format(".wisp-{:08x}{:08x}{}", random(), random(), target.extension().string());
  }
  pending_file(const pending_file&) = delete;
  pending_file& operator=(const pending_file&) = delete;
  ~pending_file() {
    std::error_code ignored;
    if (!path.empty()) fs::remove(path, ignored);
  }
  void commit() {
    std::error_code error;
    fs::rename(path, target, error);
    if (error)
      throw file_error{target.string(), "",
                       "cannot replace the file by the one just written: " + error.message()};
    path.clear();
  }
};

// Writes the file by body(FILE*), which returns false with errno set when the
// disk is full or the like; other errors show where the file is closed.
void write_file(const pending_file& pending, const auto& body) {
  auto fail = [&] {
    std::string reason = std::generic_category().message(errno ? errno : EIO);
    throw file_error{pending.target.string(), "", "cannot be written: " + reason};
  };
  errno = 0;
  auto close = [](std::FILE* file) { std::fclose(file); };
  std::unique_ptr<std::FILE, decltype(close)> file(std::fopen(pending.path.c_str(), "wbx"), close);
  if (!file) fail();
  if (!body(file.get())) fail();
  if (std::fclose(file.release()) != 0) fail();
}

void save_exr(const fs::path& path, const image_data& image, const image_write_options& options) {
  pending_file pending(path);
  write_file(pending, [&](std::FILE* file) { return write_exr(file, path, image, options); });
  pending.commit();
}

// Encodes into memory and writes the bytes, since not every writer of
// OpenImageIO notices a full disk.
void encode(image_module::encode_job& job, const fs::path& path, const image_data& image) {
  const auto& module = image_module::functions(path.string(), "");
  pending_file pending(path);
  job.target = path;
  job.beside = pending.path;
  job.width = image.width;
  job.height = image.height;
  auto bytes = module.encode(job);
  if (!bytes.empty())
    write_file(pending, [&](std::FILE* file) {
      return std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
    });
  pending.commit();
}

// The colour of pixel i: the first three channels, or grey.
vec3 pixel_color(const image_data& image, std::size_t i) {
  std::size_t n = image.channels.size();
  const float* p = image.pixels.data() + i * n;
  vec3 color = n >= 3 ? vec3{p[0], p[1], p[2]} : vec3{p[0]};
  for (int c = 0; c < 3; c++)
    if (std::isnan(color[c])) color[c] = 0;
  return color;
}

void save_hdr(const fs::path& path, const image_data& image) {
  std::vector<float> pixels(image.pixels.size() / image.channels.size() * 3);
  for (std::size_t i = 0; i < pixels.size() / 3; i++) {
    vec3 color = glm::clamp(pixel_color(image, i), vec3{0}, vec3{1e37f});  // what RGBE can hold
    for (int c = 0; c < 3; c++) pixels[3 * i + static_cast<std::size_t>(c)] = color[c];
  }
  image_module::encode_job job;
  job.floats = pixels;
  encode(job, path, image);
}

void save_ldr(const fs::path& path, const image_data& image, const image_write_options& options) {
  std::vector<uint8_t> pixels(image.pixels.size() / image.channels.size() * 3);
  for (std::size_t i = 0; i < pixels.size() / 3; i++) {
    vec3 color = tonemap(pixel_color(image, i), options.exposure, options.filmic);
    for (int c = 0; c < 3; c++)
      pixels[3 * i + static_cast<std::size_t>(c)] =
          static_cast<uint8_t>(std::clamp(color[c] * 255 + 0.5f, 0.0f, 255.0f));
  }
  image_module::encode_job job;
  job.bytes = pixels;
  job.compression = lower_extension(path) == ".png" ? "zip" : "jpeg:95";
  job.metadata = image.metadata;
  encode(job, path, image);
}

// What is known to be wrong with a file to write before there is an image.
void check_target(const fs::path& path, int width, int height) {
  auto fail = [&](const std::string& reason) { throw file_error{path.string(), "", reason}; };
  if (!can_save_image(path))
    fail("images are written as .exr, .hdr, .png or .jpg; the name must end in one of them");
  std::error_code error;
  auto folder = path.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, error))
    fail("the folder " + folder.string() + " does not exist");
  error.clear();
  if (fs::is_directory(path, error)) fail("is a folder, where a file is to be written");
  if (error == std::errc::filename_too_long) fail("cannot be written: " + error.message());
  // libjpeg's limit, of which OpenImageIO only learns when libjpeg ends the program.
  constexpr int most = 65500;
  auto extension = lower_extension(path);
  if ((extension == ".jpg" || extension == ".jpeg") && std::max(width, height) > most)
    fail(fmt::format("a .jpg has at most {} pixels on a side; {} x {} fit in .exr, .hdr or .png",
                     most, width, height));
}

}  // namespace

vec3 tonemap(const vec3& rgb, float exposure, bool use_filmic) {
  vec3 color = rgb * std::exp2(exposure);
  for (int c = 0; c < 3; c++) {
    if (std::isnan(color[c])) color[c] = 0;
    color[c] = std::clamp(color[c], 0.0f, 1e30f);
  }
  if (use_filmic) color = filmic(color);
  for (int c = 0; c < 3; c++) color[c] = linear_to_srgb(color[c]);
  return color;
}

bool can_save_image(const fs::path& path) {
  auto extension = lower_extension(path);
  for (auto known : {".exr", ".hdr", ".png", ".jpg", ".jpeg"})
    if (extension == known) return true;
  return false;
}

void check_image_output(const fs::path& path, int width, int height) {
  check_target(path, width, height);
  if (lower_extension(path) != ".exr") image_module::functions(path.string(), "");
  pending_file pending(path);
  write_file(pending, [](std::FILE*) { return true; });
}

void save_image(const fs::path& path, const image_data& image, const image_write_options& options) {
  auto fail = [&](const std::string& reason) { throw file_error{path.string(), "", reason}; };
  check_target(path, image.width, image.height);
  if (image.width <= 0 || image.height <= 0 || image.channels.empty())
    fail("the image to write has no pixels");
  auto pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  if (image.pixels.size() != pixels * image.channels.size())
    fail(fmt::format("the image to write has {} values, where {} x {} pixels of {} channels are {}",
                     image.pixels.size(), image.width, image.height, image.channels.size(),
                     pixels * image.channels.size()));
  try {
    auto extension = lower_extension(path);
    if (extension == ".exr")
      save_exr(path, image, options);
    else if (extension == ".hdr")
      save_hdr(path, image);
    else
      save_ldr(path, image, options);
  } catch (const std::bad_alloc&) {
    fail("not enough memory to encode the image");
  }
}

}  // namespace wisp
