#pragma once

// Images in and out, by OpenImageIO and OpenEXR. Calls from several threads do not disturb
// each other as long as nobody changes what another reads: load_texture and load_textures
// change what they are given.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "wisp/core/error.h"
#include "wisp/core/export.h"
#include "wisp/core/math.h"
#include "wisp/scene/scene.h"

namespace wisp {

// A float image with named channels, interleaved, top row first.
struct image_data {
  int width = 0;
  int height = 0;
  std::vector<std::string> channels = {};  // "R", "G", "B", "A", "albedo.R", ...
  std::vector<float> pixels = {};          // width * height * channels.size()
  // Text written into the file's header where the format has one.
  std::vector<std::pair<std::string, std::string>> metadata = {};
};

struct image_write_options {
  float exposure = 0;       // stops, for formats that are tone mapped
  bool filmic = true;       // tone curve of .png and .jpg; false: plain sRGB, clipped
  bool half_float = false;  // .exr: half instead of float, except for depth ("Z", "depth.Z")
};

// Reads an image file into a texture: fills width, height and one of the pixel
// arrays. Grey becomes RGB, a missing alpha becomes 1. Colour is not multiplied
// by alpha. Integers of 16 bits are rounded to 8, since a texture does not know
// whether it holds sRGB colours or plain numbers; floats that are not finite
// become 0. Throws file_error, also for images of more than 2^30 pixels and for
// headers that claim more pixels than their file can hold.
WISP_API void load_texture(texture_data& texture);

// Loads the textures with used[i] true that have no pixels yet, over `threads`
// threads. Returns the bytes of the pixels of all used ones. Throws the
// file_error of the first that fails, by index.
WISP_API std::size_t load_textures(scene_data& scene, const std::vector<bool>& used,
                                   int threads = 0);

// Reads any image file as float with the names of its channels and its text
// metadata; integer samples are decoded from sRGB, except for alpha.
WISP_API image_data load_image(const std::filesystem::path& path);

// Writes by ending: .exr (all channels, linear, float, metadata), .hdr (the
// first three, linear), .png and .jpg (the first three, tone mapped); of fewer
// than three channels the first as grey. NaN is written as 0. The file appears
// whole or not at all. Throws file_error, also for other endings.
WISP_API void save_image(const std::filesystem::path& path, const image_data& image,
                         const image_write_options& options = {});
WISP_API bool can_save_image(const std::filesystem::path& path);

// Throws the file_error that save_image would throw for this name (and size,
// where it is known), to be called before hours of work rather than after: no
// such ending or folder, no right to write there, an image module that is needed
// and missing, more pixels than the format takes.
WISP_API void check_image_output(const std::filesystem::path& path, int width = 0, int height = 0);

// The tone curve of .png and .jpg: exposure in stops, a filmic shoulder that
// keeps hue and reaches white at 12 (nothing changes up to mid-grey, 0.18), then
// the sRGB encoding; result in [0, 1]. Monotone in exposure. Without filmic:
// sRGB, clipped at 1.
WISP_API vec3 tonemap(const vec3& rgb, float exposure, bool filmic);

// Bilinear lookup at a texture coordinate. as_linear leaves 8-bit values as
// they are (normals, roughness); otherwise they are decoded from sRGB.
WISP_API vec4 eval_texture(const texture_data& texture, const vec2& uv, bool as_linear);

}  // namespace wisp
