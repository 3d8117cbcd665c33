// Writing of images, by OpenImageIO, and the tone curve of .png and .jpg.
//
// A file is written under another name beside its place and renamed when it is
// complete, so that a reader never sees half of one.

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <memory>
#include <new>
#include <span>
#include <string_view>
#include <system_error>

#include "wisp/render/image.h"

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

bool is_depth_channel(std::string_view name) {
  if (auto dot = name.rfind('.'); dot != std::string_view::npos) {
    if (name.substr(0, dot) == "depth") return true;
    name = name.substr(dot + 1);
  }
  return name == "Z" || name == "z" || name == "depth";
}

// A file beside the wanted one that vanishes unless it is renamed. The ending
// stays, since it chooses the format.
struct pending_file {
  fs::path target = "";
  fs::path path = "";

  explicit pending_file(const fs::path& target_) : target(target_) {
    auto name = OIIO::Filesystem::unique_path(".wisp-%%%%%%%%.");
    path = target.parent_path() / (name + target.filename().string());
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

std::string first_line(std::string message, const char* otherwise) {
  if (auto end = message.find_first_of("\r\n"); end != std::string::npos) message.resize(end);
  return message.empty() ? otherwise : message;
}

// OpenImageIO encodes into memory and this writes the bytes, since not every
// writer of it notices a full disk.
void write_bytes(const fs::path& wanted, const fs::path& path, std::span<const uint8_t> bytes) {
  auto fail = [&] {
    std::string reason = std::generic_category().message(errno);
    throw file_error{wanted.string(), "", "cannot be written: " + reason};
  };
  errno = 0;
  auto close = [](std::FILE* file) { std::fclose(file); };
  std::unique_ptr<std::FILE, decltype(close)> file(OIIO::Filesystem::fopen(path.string(), "wb"),
                                                   close);
  if (!file) fail();
  if (std::fwrite(bytes.data(), 1, bytes.size(), file.get()) != bytes.size()) fail();
  if (std::fclose(file.release()) != 0) fail();
}

void encode(const fs::path& path, const OIIO::ImageSpec& spec, OIIO::TypeDesc format,
            const void* pixels) {
  auto fail = [&](const std::string& reason) { throw file_error{path.string(), "", reason}; };
  pending_file pending(path);
  auto output = OIIO::ImageOutput::create(pending.path.string());
  if (!output) fail(first_line(OIIO::geterror(), "no writer for this format is installed"));
  bool in_memory = output->supports("ioproxy");
  std::vector<uint8_t> bytes;
  OIIO::Filesystem::IOVecOutput proxy(bytes);
  if (in_memory) output->set_ioproxy(&proxy);
  if (!output->open(pending.path.string(), spec) || !output->write_image(format, pixels) ||
      !output->close())
    fail("cannot be written: " + first_line(output->geterror(), "unknown reason"));
  output.reset();
  if (in_memory) write_bytes(path, pending.path, bytes);
  pending.commit();
}

void save_exr(const fs::path& path, const image_data& image, const image_write_options& options) {
  int channels = static_cast<int>(image.channels.size());
  OIIO::ImageSpec spec(image.width, image.height, channels, OIIO::TypeDesc::FLOAT);
  spec.channelnames = image.channels;
  spec.alpha_channel = -1;
  std::vector<bool> half(image.channels.size(), false);
  if (options.half_float)
    for (std::size_t c = 0; c < half.size(); c++) half[c] = !is_depth_channel(image.channels[c]);
  bool all_half = std::find(half.begin(), half.end(), false) == half.end();
  bool any_half = std::find(half.begin(), half.end(), true) != half.end();
  if (all_half) spec.set_format(OIIO::TypeDesc::HALF);
  if (any_half && !all_half)
    for (bool h : half)
      spec.channelformats.push_back(h ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
  spec.attribute("compression", "zip");
  for (const auto& [name, value] : image.metadata) spec.attribute(name, value);
  for (std::size_t c = 0; c < image.channels.size(); c++)
    if (image.channels[c] == "A") spec.alpha_channel = static_cast<int>(c);

  // What a viewer would choke on is repaired in a copy, made only when needed.
  constexpr float half_max = 65504;
  auto is_bad = [&](float v, std::size_t c) {
    return std::isnan(v) || (half[c] && !(std::abs(v) <= half_max));
  };
  std::vector<float> repaired;
  for (std::size_t i = 0; i < image.pixels.size(); i++) {
    float v = image.pixels[i];
    if (!is_bad(v, i % half.size())) continue;
    if (repaired.empty()) repaired = image.pixels;
    repaired[i] = std::isnan(v) ? 0 : std::copysign(half_max, v);
  }
  encode(path, spec, OIIO::TypeDesc::FLOAT,
         repaired.empty() ? image.pixels.data() : repaired.data());
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
  std::vector<vec3> pixels(image.pixels.size() / image.channels.size());
  for (std::size_t i = 0; i < pixels.size(); i++)
    pixels[i] = glm::clamp(pixel_color(image, i), vec3{0}, vec3{1e37f});  // what RGBE can hold
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::FLOAT);
  encode(path, spec, OIIO::TypeDesc::FLOAT, pixels.data());
}

void save_ldr(const fs::path& path, const image_data& image, const image_write_options& options) {
  std::vector<uint8_t> pixels(image.pixels.size() / image.channels.size() * 3);
  for (std::size_t i = 0; i < pixels.size() / 3; i++) {
    vec3 color = tonemap(pixel_color(image, i), options.exposure, options.filmic);
    for (int c = 0; c < 3; c++)
      pixels[3 * i + static_cast<std::size_t>(c)] =
          static_cast<uint8_t>(std::clamp(color[c] * 255 + 0.5f, 0.0f, 255.0f));
  }
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Compression", lower_extension(path) == ".png" ? "zip" : "jpeg:95");
  for (const auto& [name, value] : image.metadata) spec.attribute(name, value);
  encode(path, spec, OIIO::TypeDesc::UINT8, pixels.data());
}

}  // namespace

vec3 tonemap(const vec3& rgb, float exposure, bool use_filmic) {
  vec3 color = rgb * std::exp2(exposure);
  for (int c = 0; c < 3; c++) {
    if (std::isnan(color[c])) color[c] = 0;
    color[c] = std::clamp(color[c], 0.0f, 1e30f);
  }
  if (use_filmic) color = filmic(color);
  for (int c = 0; c < 3; c++)
    color[c] = linear_to_srgb(color[c]);
  return color;
}

bool can_save_image(const fs::path& path) {
  auto extension = lower_extension(path);
  for (auto known : {".exr", ".hdr", ".png", ".jpg", ".jpeg"})
    if (extension == known) return true;
  return false;
}

void save_image(const fs::path& path, const image_data& image, const image_write_options& options) {
  auto fail = [&](const std::string& reason) { throw file_error{path.string(), "", reason}; };
  if (!can_save_image(path))
    fail("images are written as .exr, .hdr, .png or .jpg; the name must end in one of them");
  if (image.width <= 0 || image.height <= 0 || image.channels.empty())
    fail("the image to write has no pixels");
  auto pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  if (image.pixels.size() != pixels * image.channels.size())
    fail(fmt::format("the image to write has {} values, where {} x {} pixels of {} channels are {}",
                     image.pixels.size(), image.width, image.height, image.channels.size(),
                     pixels * image.channels.size()));
  std::error_code error;
  auto folder = path.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, error))
    fail("the folder " + folder.string() + " does not exist");
  if (fs::is_directory(path, error)) fail("is a folder, where a file is to be written");
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
