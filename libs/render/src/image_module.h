#pragma once

// What the image module gives to wisp_render. OpenImageIO brings hundreds of
// shared libraries along (on Debian: OpenCV, ffmpeg, OpenBLAS, ...), so that it
// is linked into a module of its own, which is loaded when an image of another
// format than .exr is written or any image is read. A run that does neither does
// not pay for them.
//
// Both sides are built from the same sources by the same compiler: types of
// wisp and exceptions (file_error, std::bad_alloc) cross the border.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "wisp/render/image.h"

namespace wisp::image_module {

// An image to encode: bytes or floats, interleaved, three channels.
struct encode_job {
  std::filesystem::path target = "";  // for messages
  std::filesystem::path beside = "";  // its ending chooses the format
  int width = 0;
  int height = 0;
  std::span<const uint8_t> bytes = {};  // one of the two is not empty
  std::span<const float> floats = {};
  std::string compression = "";
  std::span<const std::pair<std::string, std::string>> metadata = {};
};

// Defined in the module.
void read_texture(texture_data& texture);
image_data read_image(const std::filesystem::path& path);
// The encoded file. Where the format's writer wants a file it is written as
// `beside`, and nothing is returned.
std::vector<uint8_t> encode(const encode_job& job);

}  // namespace wisp::image_module

struct wisp_image_functions {
  // Of the build that made the module; first, so that they can always be read.
  // A module whose types have another shape must not be called.
  std::size_t sizes[4];
  const char* version;
  decltype(&wisp::image_module::read_texture) read_texture;
  decltype(&wisp::image_module::read_image) read_image;
  decltype(&wisp::image_module::encode) encode;
};

namespace wisp::image_module {

inline constexpr std::size_t sizes[4] = {sizeof(wisp_image_functions), sizeof(texture_data),
                                         sizeof(image_data), sizeof(encode_job)};

// The functions of the module, which is loaded when first asked for and stays.
// Throws a file_error for `file` and `place` where that fails.
const wisp_image_functions& functions(const std::string& file, const std::string& place);

// The first module in these folders that can be used, or null and why not, with
// what was tried.
const wisp_image_functions* load(const std::vector<std::filesystem::path>& folders,
                                 std::string& problem);

}  // namespace wisp::image_module

// The one symbol of the module.
extern "C" __attribute__((visibility("default"))) const wisp_image_functions* wisp_image_module();
