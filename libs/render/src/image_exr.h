#pragma once

#include <cstdio>
#include <filesystem>

#include "wisp/render/image.h"

namespace wisp {

// Writes an OpenEXR file into `file`, from its start. False, with errno set,
// when the bytes cannot be written; throws a file_error for `path`, a name for
// messages, when the image cannot be an OpenEXR file.
bool write_exr(std::FILE* file, const std::filesystem::path& path, const image_data& image,
               const image_write_options& options);

}  // namespace wisp
