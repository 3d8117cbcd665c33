// Finds and loads the image module.

#include <dlfcn.h>
#include <fmt/format.h>
#include <link.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <system_error>

#include "image_module.h"

namespace wisp::image_module {

namespace fs = std::filesystem;

namespace {

// The folder of the program or the shared library that this code is part of.
// A program's name as dladdr gives it is argv[0], which may be any file of the
// working directory; its link map has no name.
fs::path code_folder() {
  static constexpr char here = 0;
  Dl_info info = {};
  void* extra = nullptr;
  if (dladdr1(&here, &info, &extra, RTLD_DL_LINKMAP) == 0 || !extra) return "";
  std::string_view name = static_cast<const link_map*>(extra)->l_name;
  std::error_code error;
  auto file = fs::canonical(name.empty() ? "/proc/self/exe" : name, error);
  return error ? fs::path() : file.parent_path();
}

bool is_inside(const fs::path& path, const fs::path& folder) {
  std::error_code error;
  auto relative = path.lexically_relative(fs::weakly_canonical(folder, error));
  return !relative.empty() && *relative.begin() != "..";
}

std::vector<fs::path> module_folders() {
  std::vector<fs::path> folders;
  auto add = [&](const fs::path& folder) {
    auto normal = folder.lexically_normal();
    if (std::find(folders.begin(), folders.end(), normal) == folders.end())
      folders.push_back(normal);
  };
  // Ignored in programs that run with another user's rights.
  const char* chosen = secure_getenv("WISP_MODULE_DIR");
  std::error_code error;
  if (chosen && *chosen) add(fs::absolute(chosen, error));
  auto here = code_folder();
  if (!here.empty()) {
    add(here);
    add(here / "wisp");
    add(here / "../lib/wisp");
    add(here / ".." / WISP_INSTALL_LIBDIR / "wisp");
    // What lies in the tree of this build must not meet an older module that
    // was installed.
    if (is_inside(here, WISP_BUILD_DIR)) add(WISP_BUILD_MODULE_DIR);
  }
  add(WISP_INSTALL_MODULE_DIR);
  add(WISP_BUILD_MODULE_DIR);
  return folders;
}

struct loaded_module {
  const wisp_image_functions* functions = nullptr;
  std::string problem = "";
};

loaded_module load_once() {
  loaded_module result;
  result.functions = load(module_folders(), result.problem);
  return result;
}

}  // namespace

const wisp_image_functions* load(const std::vector<fs::path>& folders, std::string& problem) {
  std::string missing, refused;
  for (const auto& folder : folders) {
    auto file = folder / WISP_MODULE_NAME;
    auto refuse = [&](const std::string& why) {
      refused += fmt::format("; {} cannot be used: {}", file.string(), why);
    };
    std::error_code error;
    if (!fs::exists(file, error)) {
      missing += (missing.empty() ? "" : ", ") + folder.string();
      continue;
    }
    // Local: the symbols of OpenImageIO and what it needs stay among themselves.
    // What was opened stays open, since OpenImageIO has threads that outlive any
    // use.
    void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle) {
      const char* why = dlerror();
      refuse(why ? why : "unknown reason");
      continue;
    }
    auto get = reinterpret_cast<decltype(&wisp_image_module)>(dlsym(handle, "wisp_image_module"));
    if (!get) {
      refuse("it is no image module of wisp");
      continue;
    }
    const auto* functions = get();
    if (functions && std::equal(std::begin(sizes), std::end(sizes), functions->sizes) &&
        std::string_view(functions->version) == WISP_VERSION)
      return functions;
    refuse("it belongs to another version of wisp");
  }
  if (!missing.empty()) missing = ", which is not in " + missing;
  problem = fmt::format(
      "needs {}, wisp's module for images{}{}. The environment variable WISP_MODULE_DIR may name "
      "its folder",
      WISP_MODULE_NAME, missing, refused);
  return nullptr;
}

const wisp_image_functions& functions(const std::string& file, const std::string& place) {
  static const loaded_module module = load_once();
  if (!module.functions) throw file_error{file, place, module.problem};
  return *module.functions;
}

}  // namespace wisp::image_module
