// Reading of images: by the image module, and in parallel.

#include "wisp/render/image.h"

#include <algorithm>
#include <exception>

#include "image_module.h"
#include "wisp/core/parallel.h"

namespace wisp {

namespace fs = std::filesystem;

namespace {

std::size_t pixel_bytes(const texture_data& texture) {
  return texture.pixelsf.size() * sizeof(vec4) + texture.pixelsb.size() * sizeof(u8vec4);
}

}  // namespace

void load_texture(texture_data& texture) {
  auto place = texture.name.empty() ? "texture" : "texture '" + texture.name + "'";
  auto file = texture.path.empty() ? "embedded image" : texture.path.string();
  image_module::functions(file, place).read_texture(texture);
}

std::size_t load_textures(scene_data& scene, const std::vector<bool>& used, int threads) {
  std::vector<std::size_t> wanted;
  for (std::size_t i = 0; i < std::min(used.size(), scene.textures.size()); i++)
    if (used[i]) wanted.push_back(i);
  // Every failure is kept, so that the one reported does not depend on threads.
  std::vector<std::exception_ptr> failures(wanted.size());
  parallel_for(wanted.size(), threads, [&](std::size_t i) {
    auto& texture = scene.textures[wanted[i]];
    if (pixel_bytes(texture) != 0) return;
    try {
      load_texture(texture);
    } catch (...) {
      failures[i] = std::current_exception();
    }
  });
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < wanted.size(); i++) {
    if (failures[i]) std::rethrow_exception(failures[i]);
    bytes += pixel_bytes(scene.textures[wanted[i]]);
  }
  return bytes;
}

image_data load_image(const fs::path& path) {
  return image_module::functions(path.string(), "").read_image(path);
}

}  // namespace wisp
