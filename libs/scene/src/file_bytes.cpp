#include "file_bytes.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <memory>
#include <string>
#include <system_error>

#include "wisp/core/error.h"

namespace wisp {

namespace {

namespace fs = std::filesystem;

struct file_closer {
  void operator()(std::FILE* f) const { std::fclose(f); }
};
using file_handle = std::unique_ptr<std::FILE, file_closer>;

std::string reason_of(int code) { return std::generic_category().message(code); }

// Opens a file beside `path` that did not exist before; its name in `beside`.
file_handle open_beside(const fs::path& path, fs::path& beside) {
  constexpr int attempts = 1000;  // others may be writing, or have left theirs behind
  for (int i = 0; i < attempts; ++i) {
    beside = path;
    beside += fmt::format(".{}.part", i);
    errno = 0;
    file_handle file(std::fopen(beside.string().c_str(), "wbx"));
    if (file || errno != EEXIST) return file;
  }
  return nullptr;
}

// False, with errno set, when a byte could not be written.
bool put_bytes(file_handle file, std::string_view bytes) {
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size();
  const int code = errno;
  const bool closed = std::fclose(file.release()) == 0;  // a full disk may show only here
  if (!written) errno = code;
  return written && closed;
}

}  // namespace

std::vector<uint8_t> read_file(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) {
    throw file_error(path.string(), "", "does not exist");
  }
  if (fs::is_directory(status)) {
    throw file_error(path.string(), "", "is a folder, but a file is wanted here");
  }
  errno = 0;
  const file_handle file(std::fopen(path.string().c_str(), "rb"));
  if (!file) throw file_error(path.string(), "", "cannot be opened: " + reason_of(errno));

  // The size is a hint only: pipes have none, and a file may grow.
  std::vector<uint8_t> bytes;
  const uintmax_t size = fs::is_regular_file(status) ? fs::file_size(path, error) : 0;
  if (!error) bytes.reserve(static_cast<std::size_t>(size) + 1);
  constexpr std::size_t chunk = std::size_t{1} << 20;
  while (true) {
    const std::size_t at = bytes.size();
    const std::size_t room = bytes.capacity() > at ? bytes.capacity() - at : chunk;
    bytes.resize(at + room);
    const std::size_t got = std::fread(bytes.data() + at, 1, room, file.get());
    bytes.resize(at + got);
    if (std::ferror(file.get())) {
      throw file_error(path.string(), "", "cannot be read: " + reason_of(errno));
    }
    if (got < room) return bytes;
  }
}

void write_file(const fs::path& path, std::string_view bytes) {
  const std::string name = path.string();
  std::error_code error;
  if (fs::is_directory(path, error)) {
    throw file_error(name, "", "is a folder, so that no file can be written under its name");
  }
  const fs::path folder = path.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, error)) {
    throw file_error(name, "",
                     fmt::format("cannot be written: there is no folder {}", folder.string()));
  }
  errno = 0;
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) {
    // A device or a pipe must not be replaced by a file.
    file_handle file(std::fopen(name.c_str(), "wb"));
    if (!file || !put_bytes(std::move(file), bytes)) {
      throw file_error(name, "", "cannot be written: " + reason_of(errno));
    }
    return;
  }
  // A link goes on pointing where it does: the file behind it is replaced.
  fs::path target = path;
  if (fs::is_symlink(path, error)) {
    target = fs::weakly_canonical(path, error);
    if (error) target = path;
  }
  fs::path beside;
  file_handle file = open_beside(target, beside);
  if (!file) throw file_error(name, "", "cannot be written: " + reason_of(errno));
  bool done = put_bytes(std::move(file), bytes);
  std::string reason = done ? "" : reason_of(errno);
  if (done) {
    fs::rename(beside, target, error);
    done = !error;
    reason = error.message();
  }
  if (!done) {
    std::error_code ignored;
    fs::remove(beside, ignored);
    throw file_error(name, "", "cannot be written: " + reason);
  }
}

}  // namespace wisp
