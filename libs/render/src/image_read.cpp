// Reading of images, by OpenImageIO. Part of the image module.
//
// Everything that a header claims is held against the bytes that are there
// before memory is set aside for it: a corrupt header must not be able to ask
// for gigabytes.

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <fstream>
#include <memory>
#include <new>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include "image_module.h"

namespace wisp::image_module {

namespace fs = std::filesystem;

namespace {

constexpr uint64_t max_pixels = 1ull << 30;

float srgb_to_linear(float c) {
  return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
}

// Who is being read, for messages.
struct image_source {
  std::string file = "";
  std::string place = "";
  uint64_t bytes = 0;  // size of the encoded file
};

[[noreturn]] void fail(const image_source& source, const std::string& reason) {
  throw file_error{source.file, source.place, reason};
}

// The first line of a message of OpenImageIO, without its line end.
std::string first_line(std::string message, const char* otherwise) {
  if (auto end = message.find_first_of("\r\n"); end != std::string::npos) message.resize(end);
  return message.empty() ? otherwise : message;
}

// The format of an encoded image by its first bytes, as OpenImageIO names it;
// empty when they say nothing.
std::string sniff_format(std::span<const uint8_t> bytes) {
  auto has = [&](std::size_t at, std::string_view magic) {
    return bytes.size() >= at + magic.size() &&
           std::memcmp(bytes.data() + at, magic.data(), magic.size()) == 0;
  };
  using namespace std::string_view_literals;
  if (has(0, "\x89PNG"sv)) return "png";
  if (has(0, "\xff\xd8\xff"sv)) return "jpg";
  if (has(0, "\x76\x2f\x31\x01"sv)) return "exr";
  if (has(0, "#?"sv)) return "hdr";
  if (has(0, "II*\0"sv) || has(0, "MM\0*"sv)) return "tif";
  if (has(0, "RIFF"sv) && has(8, "WEBP"sv)) return "webp";
  if (has(0, "GIF8"sv)) return "gif";
  if (has(0, "DDS "sv)) return "dds";
  if (has(0, "8BPS"sv)) return "psd";
  if (has(0, "BM"sv)) return "bmp";
  // TGA has no magic at its start; new files end with this footer.
  if (bytes.size() > 26 && has(bytes.size() - 18, "TRUEVISION-XFILE."sv)) return "tga";
  return "";
}

// Follows the chunks of a PNG to its end. OpenImageIO leaves error messages of
// libpng on stderr when one is cut off, and 2.4 leaks memory besides; a cut file
// does not come that far. read(at, to) fills `to` from byte `at` on.
void check_png(const image_source& source, const auto& read) {
  for (uint64_t at = 8;;) {
    std::array<uint8_t, 8> head = {};
    if (at + 12 > source.bytes || !read(at, std::span{head}))
      fail(source, fmt::format("the file is truncated: it ends at byte {}, before its last chunk",
                               source.bytes));
    if (std::memcmp(head.data() + 4, "IEND", 4) == 0) return;
    at += 12 + (static_cast<uint64_t>(head[0]) << 24 | static_cast<uint64_t>(head[1]) << 16 |
                static_cast<uint64_t>(head[2]) << 8 | head[3]);
  }
}

void check_png_file(const image_source& source, const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  auto read = [&](uint64_t at, std::span<uint8_t> to) {
    in.seekg(static_cast<std::streamoff>(at));
    in.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(to.size()));
    return static_cast<std::size_t>(in.gcount()) == to.size();
  };
  std::array<uint8_t, 8> magic = {};
  if (read(0, magic) && sniff_format(magic) == "png") check_png(source, read);
}

void check_png_memory(const image_source& source, std::span<const uint8_t> bytes) {
  check_png(source, [&](uint64_t at, std::span<uint8_t> to) {
    if (at > bytes.size() || to.size() > bytes.size() - at) return false;
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), to.size(), to.begin());
    return true;
  });
}

// An open image. Members are destroyed in reverse: the reader, then its bytes,
// then the temporary file.
struct image_reader {
  struct temporary_file {
    fs::path path = "";
    temporary_file() = default;
    temporary_file(temporary_file&& other) noexcept : path(std::exchange(other.path, "")) {}
    temporary_file& operator=(temporary_file&&) = delete;
    ~temporary_file() {
      std::error_code ignored;
      if (!path.empty()) fs::remove(path, ignored);
    }
  };
  temporary_file temporary = {};
  std::unique_ptr<OIIO::Filesystem::IOMemReader> memory = {};
  std::unique_ptr<OIIO::ImageInput> input = {};
};

// Colours as they are stored: glTF and Yocto/GL have alpha beside the colour,
// not multiplied into it.
OIIO::ImageSpec read_config() {
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  return config;
}

image_reader open_file(image_source& source, const fs::path& path) {
  std::error_code error;
  auto status = fs::status(path, error);
  if (!fs::exists(status)) fail(source, "file not found");
  if (fs::is_directory(status)) fail(source, "is a folder, where an image file is wanted");
  if (!fs::is_regular_file(status)) fail(source, "is not a regular file");
  source.bytes = fs::file_size(path, error);
  if (error) fail(source, "cannot be read: " + error.message());
  if (source.bytes == 0) fail(source, "the file is empty");
  check_png_file(source, path);
  auto config = read_config();
  image_reader reader;
  reader.input = OIIO::ImageInput::open(path.string(), &config);
  if (!reader.input)
    fail(source, first_line(OIIO::geterror(), "is not an image that OpenImageIO can read"));
  return reader;
}

image_reader open_memory(image_source& source, std::span<const uint8_t> bytes) {
  source.bytes = bytes.size();
  auto format = sniff_format(bytes);
  if (format.empty())
    fail(source, "the embedded image is of no known format; PNG and JPEG are what glTF allows");
  if (format == "png") check_png_memory(source, bytes);
  image_reader reader;
  reader.input = OIIO::ImageInput::create(format);
  if (!reader.input)
    fail(source, first_line(OIIO::geterror(), "no reader for this format is installed"));
  auto config = read_config();
  std::string name = "memory." + format;
  if (reader.input->supports("ioproxy")) {
    reader.memory = std::make_unique<OIIO::Filesystem::IOMemReader>(bytes.data(), bytes.size());
    reader.input->set_ioproxy(reader.memory.get());
  } else {
    // Few formats still want a file with a name.
    std::string unique = OIIO::Filesystem::unique_path("wisp-%%%%%%%%%%%%." + format);
    reader.temporary.path = fs::temp_directory_path() / unique;
    name = reader.temporary.path.string();
    std::ofstream out(reader.temporary.path, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()),
              static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out) fail(source, "cannot write the temporary file " + name + " to decode the image");
  }
  OIIO::ImageSpec opened;
  if (!reader.input->open(name, opened, config))
    fail(source, first_line(reader.input->geterror(), "the image is corrupt"));
  return reader;
}

// Rejects sizes that no file of this length can hold.
void check_size(const image_source& source, const OIIO::ImageInput& input) {
  const auto& spec = input.spec();
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0)
    fail(source, "the image has no pixels");
  uint64_t pixels = static_cast<uint64_t>(spec.width) * static_cast<uint64_t>(spec.height);
  if (pixels > max_pixels)
    fail(source, fmt::format("{} x {} pixels are more than the limit of {} million", spec.width,
                             spec.height, max_pixels / 1000000));
  if (spec.depth > 1) fail(source, "volume images cannot be used as textures");
  // Deflate, the tightest of the usual codes, packs 1032 to one; the codes of
  // videos have no such limit.
  constexpr uint64_t small = 64ull << 20, ratio = 8192;
  uint64_t decoded = pixels * static_cast<uint64_t>(spec.pixel_bytes(true));
  std::string_view format = input.format_name();
  bool unlimited = format == "webp" || format == "jpegxl" || format == "heif";
  if (!unlimited && decoded > small && decoded / ratio > source.bytes)
    fail(source, fmt::format("the header says {} x {} pixels, which {} bytes cannot hold: the "
                             "file is truncated or corrupt",
                             spec.width, spec.height, source.bytes));
}

bool is_float_format(const OIIO::ImageSpec& spec) { return spec.format.is_floating_point(); }

void read_pixels(const image_source& source, OIIO::ImageInput& input, int channels,
                 OIIO::TypeDesc format, void* data) {
  if (!input.read_image(0, 0, 0, channels, format, data))
    fail(source, first_line(input.geterror(),
                            "the pixels cannot be read: the file is truncated "
                            "or corrupt"));
  // Some readers report a short file and still return true.
  if (input.has_error()) fail(source, first_line(input.geterror(), "the file is corrupt"));
}

// Which of the `n` channels read are red, green, blue and alpha (-1: none).
std::array<int, 4> texture_channels(const OIIO::ImageSpec& spec, int n) {
  int alpha = spec.alpha_channel > 0 && spec.alpha_channel < n ? spec.alpha_channel : -1;
  if (n == 1) return {0, 0, 0, -1};
  if (n == 2) return alpha == 1 ? std::array{0, 0, 0, 1} : std::array{0, 1, -1, -1};
  return {0, 1, 2, alpha};
}

// Expands n interleaved channels of T to four.
template <typename Vec, typename T>
std::vector<Vec> expand_channels(const std::vector<T>& data, std::size_t pixels, int n,
                                 const std::array<int, 4>& from, T one) {
  std::vector<Vec> result(pixels);
  for (std::size_t i = 0; i < pixels; i++) {
    const T* p = data.data() + i * static_cast<std::size_t>(n);
    for (int c = 0; c < 4; c++) {
      int k = from[static_cast<std::size_t>(c)];
      result[i][c] = k >= 0 ? p[k] : c == 3 ? one : T{0};
    }
  }
  return result;
}

void decode_texture(texture_data& texture, const image_source& source, OIIO::ImageInput& input) {
  auto spec = input.spec();
  check_size(source, input);
  int n = std::min(spec.nchannels, 4);
  auto from = texture_channels(spec, n);
  auto pixels = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height);
  bool direct = n == 4 && from[3] == 3;  // no rearranging: read in place
  std::vector<vec4> pixelsf;
  std::vector<u8vec4> pixelsb;
  if (is_float_format(spec)) {
    if (direct) {
      pixelsf.resize(pixels);
      read_pixels(source, input, n, OIIO::TypeDesc::FLOAT, pixelsf.data());
    } else {
      std::vector<float> data(pixels * static_cast<std::size_t>(n));
      read_pixels(source, input, n, OIIO::TypeDesc::FLOAT, data.data());
      pixelsf = expand_channels<vec4>(data, pixels, n, from, 1.0f);
    }
    for (auto& p : pixelsf)
      for (int c = 0; c < 4; c++)
        if (!std::isfinite(p[c])) p[c] = 0;
  } else {
    // Integers of more than eight bits are rounded to eight: a texture does
    // not know yet whether it holds sRGB colours or plain numbers.
    if (direct) {
      pixelsb.resize(pixels);
      read_pixels(source, input, n, OIIO::TypeDesc::UINT8, pixelsb.data());
    } else {
      std::vector<uint8_t> data(pixels * static_cast<std::size_t>(n));
      read_pixels(source, input, n, OIIO::TypeDesc::UINT8, data.data());
      pixelsb = expand_channels<u8vec4>(data, pixels, n, from, uint8_t{255});
    }
  }
  texture.pixelsf = std::move(pixelsf);
  texture.pixelsb = std::move(pixelsb);
  texture.width = spec.width;
  texture.height = spec.height;
}

}  // namespace

void read_texture(texture_data& texture) {
  image_source source;
  source.place = texture.name.empty() ? "texture" : "texture '" + texture.name + "'";
  source.file = texture.path.string();
  bool embedded = !texture.encoded.empty();
  if (embedded && source.file.empty()) source.file = "embedded image";
  if (source.file.empty()) fail({texture.name, "texture", 0}, "has neither a file nor pixels");
  try {
    auto reader = embedded ? open_memory(source, texture.encoded) : open_file(source, texture.path);
    decode_texture(texture, source, *reader.input);
  } catch (const file_error&) {
    throw;
  } catch (const std::bad_alloc&) {
    fail(source, "not enough memory for its pixels");
  } catch (const std::exception& error) {
    fail(source, error.what());
  }
}

image_data read_image(const fs::path& path) {
  image_source source{path.string(), "", 0};
  try {
    auto reader = open_file(source, path);
    auto spec = reader.input->spec();
    check_size(source, *reader.input);
    image_data image;
    image.width = spec.width;
    image.height = spec.height;
    image.channels = spec.channelnames;
    auto channels = static_cast<std::size_t>(spec.nchannels);
    image.channels.resize(channels);
    image.pixels.resize(static_cast<std::size_t>(spec.width) *
                        static_cast<std::size_t>(spec.height) * channels);
    read_pixels(source, *reader.input, spec.nchannels, OIIO::TypeDesc::FLOAT, image.pixels.data());
    if (!is_float_format(spec))
      for (std::size_t i = 0; i < image.pixels.size(); i++)
        if (static_cast<int>(i % channels) != spec.alpha_channel)
          image.pixels[i] = srgb_to_linear(image.pixels[i]);
    for (const auto& attribute : spec.extra_attribs)
      if (attribute.type() == OIIO::TypeDesc::STRING)
        image.metadata.emplace_back(attribute.name().string(), attribute.get_string());
    return image;
  } catch (const file_error&) {
    throw;
  } catch (const std::bad_alloc&) {
    fail(source, "not enough memory for its pixels");
  } catch (const std::exception& error) {
    fail(source, error.what());
  }
}

}  // namespace wisp::image_module
