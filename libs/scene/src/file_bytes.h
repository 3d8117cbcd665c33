#pragma once

// Whole files in memory.

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace wisp {

// The bytes of a file; throws file_error when it cannot be read.
std::vector<uint8_t> read_file(const std::filesystem::path& path);

// Writes beside `path`, then renames, so that the file is there whole or is what
// it was before. Throws file_error and leaves nothing behind when that fails.
void write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace wisp
