#include <fmt/format.h>

#include <algorithm>

#include "file_bytes.h"
#include "shape_formats.h"
#include "wisp/scene/io.h"

namespace wisp {

namespace {

using shape_reader = shape_data (*)(std::span<const uint8_t>, const std::string&, warning_list&,
                                    const shape_read_options&);
using shape_writer = std::string (*)(const shape_data&, const std::string&, warning_list&);

struct shape_format {
  const char* ending;
  shape_reader read;
  shape_writer write;  // nullptr where wisp does not write
};

// For the readers that know no options.
template <auto Read>
shape_data read_plain(std::span<const uint8_t> bytes, const std::string& file,
                      warning_list& warnings, const shape_read_options&) {
  return Read(bytes, file, warnings);
}

constexpr shape_format formats[] = {
    {".ply", read_ply, write_ply},
    {".obj", read_obj, write_obj},
    {".stl", read_plain<read_stl>, write_stl},
    {".hair", read_plain<read_hair>, write_hair},
    {".tfx", read_plain<read_tfx>, write_tfx},
    {".tfxmesh", read_plain<read_tfxmesh>, nullptr},
    {".pbrt", read_plain<read_pbrt_curves>, write_pbrt_curves},
};

std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + ('a' - 'A'));
  }
  return ending;
}

const shape_format* format_of(const std::filesystem::path& path) {
  const std::string ending = ending_of(path);
  const auto* found = std::find_if(std::begin(formats), std::end(formats),
                                   [&](const shape_format& f) { return ending == f.ending; });
  return found == std::end(formats) ? nullptr : found;
}

}  // namespace

bool can_load_shape(const std::filesystem::path& path) { return format_of(path) != nullptr; }

bool can_save_shape(const std::filesystem::path& path) {
  const shape_format* format = format_of(path);
  return format && format->write;
}

shape_data load_shape(const std::filesystem::path& path, warning_list& warnings,
                      const shape_read_options& options) {
  const std::string file = path.string();
  const shape_format* format = format_of(path);
  if (!format) {
    throw file_error(file, "",
                     "has an ending that is none of .ply, .obj, .stl, .hair, .tfx, .tfxmesh and "
                     ".pbrt, which are the shapes that can be read");
  }
  const std::vector<uint8_t> bytes = read_file(path);
  if (bytes.empty()) throw file_error(file, "", "is empty: it holds no faces, points or strands");
  shape_data shape = format->read(bytes, file, warnings, options);
  clean_shape(shape, file, warnings);
  if (shape.name.empty()) shape.name = path.stem().string();
  return shape;
}

subdiv_data load_subdiv_mesh(const std::filesystem::path& path, warning_list& warnings) {
  const std::string file = path.string();
  const std::string ending = ending_of(path);
  if (ending != ".ply" && ending != ".obj") {
    throw file_error(file, "", "must be an .obj or a .ply, which are the meshes of subdivs");
  }
  const std::vector<uint8_t> bytes = read_file(path);
  if (bytes.empty()) throw file_error(file, "", "is empty: it holds no faces");
  subdiv_data subdiv = ending == ".obj" ? read_obj_subdiv(bytes, file, warnings)
                                        : read_ply_subdiv(bytes, file, warnings);
  clean_subdiv(subdiv, file, warnings);
  if (subdiv.name.empty()) subdiv.name = path.stem().string();
  return subdiv;
}

void save_shape(const std::filesystem::path& path, const shape_data& shape,
                warning_list& warnings) {
  const std::string file = path.string();
  const shape_format* format = format_of(path);
  if (!format || !format->write) {
    throw file_error(file, "",
                     "has an ending that is none of .ply, .obj, .stl, .hair, .tfx and .pbrt, which "
                     "are the shapes that can be written");
  }
  check_shape(shape, file);
  write_file(path, format->write(shape, file, warnings));
}

}  // namespace wisp
