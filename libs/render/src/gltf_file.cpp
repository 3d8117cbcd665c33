// The container of glTF: .gltf (JSON) or .glb (chunks), buffers and images.
// glTF 2.0 specification, Khronos Group, sections 3.6.1 and 4.4.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <limits>
#include <new>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>

#include "gltf_internal.h"

namespace wisp::gltf_detail {

namespace fs = std::filesystem;
using json = nlohmann::json;

namespace {

constexpr int max_json_depth = 128;

const std::array supported_extensions = {
    "KHR_lights_punctual",   "KHR_materials_emissive_strength",
    "KHR_materials_ior",     "KHR_materials_transmission",
    "KHR_materials_unlit",   "KHR_materials_volume",
    "KHR_mesh_quantization", "KHR_texture_transform",
    "EXT_texture_webp",
};
const std::array compressions = {"KHR_draco_mesh_compression", "EXT_meshopt_compression",
                                 "KHR_meshopt_compression"};

template <typename List>
bool contains(const List& list, const std::string& name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

std::string compression_reason(const std::string& extension) {
  return "its meshes are compressed with " + extension +
         ", which is not supported; decompress the file first (for example: import it in Blender "
         "and export it with compression turned off)";
}

uint32_t read_u32(std::span<const uint8_t> bytes, std::size_t at) {
  return static_cast<uint32_t>(bytes[at]) | static_cast<uint32_t>(bytes[at + 1]) << 8 |
         static_cast<uint32_t>(bytes[at + 2]) << 16 | static_cast<uint32_t>(bytes[at + 3]) << 24;
}

struct glb_chunks {
  std::string_view json = "";
  std::optional<std::span<const uint8_t>> binary = {};
};

glb_chunks split_glb(const gltf_file& file) {
  std::span<const uint8_t> bytes = file.bytes;
  if (bytes.size() < 20) fail(file, "byte 0", "the file is truncated: it ends within its header");
  uint32_t version = read_u32(bytes, 4), length = read_u32(bytes, 8);
  if (version != 2)
    fail(file, "byte 4", fmt::format("is binary glTF version {}; only version 2 is read", version));
  if (length > bytes.size())
    fail(file, "byte 8",
         fmt::format("the file is truncated: its header says {} bytes, it has {}", length,
                     bytes.size()));
  glb_chunks chunks;
  std::size_t at = 12;
  for (int index = 0; at + 8 <= length; index++) {
    uint32_t size = read_u32(bytes, at), type = read_u32(bytes, at + 4);
    auto place = fmt::format("byte {}", at);
    at += 8;
    if (size > length - at)
      fail(file, place, fmt::format("a chunk of {} bytes goes beyond the end of the file", size));
    auto data = bytes.subspan(at, size);
    constexpr uint32_t json_chunk = 0x4e4f534a, binary_chunk = 0x004e4942;
    if (index == 0) {
      if (type != json_chunk) fail(file, place, "the first chunk must be JSON");
      chunks.json = {reinterpret_cast<const char*>(data.data()), data.size()};
    } else if (type == binary_chunk && !chunks.binary) {
      chunks.binary = data;
    }  // others are to be ignored
    at += (static_cast<std::size_t>(size) + 3) / 4 * 4;
  }
  return chunks;
}

json parse_json(const gltf_file& file, std::string_view text) {
  try {
    // tinygltf and nlohmann's output recurse: nesting has to have a limit.
    return json::parse(text.begin(), text.end(), [&](int depth, json::parse_event_t, json&) {
      if (depth > max_json_depth)
        fail(file, "", fmt::format("its JSON is nested deeper than {} levels", max_json_depth));
      return true;
    });
  } catch (const json::exception& error) {
    std::string reason = error.what();
    if (auto end = reason.find("] "); end != std::string::npos) reason.erase(0, end + 2);
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    if (reason.size() > 300) reason.resize(300);
    fail(file, "", "is not valid JSON: " + reason);
  }
}

std::vector<std::string> string_list(const json& root, const char* key) {
  std::vector<std::string> result;
  if (auto it = root.find(key); it != root.end() && it->is_array())
    for (const auto& item : *it)
      if (item.is_string()) result.push_back(item.get<std::string>());
  return result;
}

std::string get_string(const json& object, const char* key) {
  auto it = object.find(key);
  return it != object.end() && it->is_string() ? it->get<std::string>() : std::string{};
}

void check_header(const gltf_file& file, const json& root, warning_list& warnings) {
  if (!root.is_object()) fail(file, "", "is not glTF: the JSON must be an object");
  auto asset = root.find("asset");
  if (asset == root.end() || !asset->is_object())
    fail(file, "asset", "is missing: this is no glTF file");
  auto version = get_string(*asset, "version");
  if (version.substr(0, 2) != "2.")
    fail(file, "asset.version",
         "is '" + version + "'; only glTF 2.0 is read: convert the file to it");
  for (const auto& extension : string_list(root, "extensionsRequired")) {
    if (contains(compressions, extension))
      fail(file, "extensionsRequired", compression_reason(extension));
    if (!contains(supported_extensions, extension))
      fail(file, "extensionsRequired",
           "the file cannot be read without " + extension +
               ", which is not supported; export it without this "
               "extension");
  }
  for (const auto& extension : string_list(root, "extensionsUsed"))
    if (!contains(supported_extensions, extension))
      warnings.push_back(file.path.string() + ": extensionsUsed: " + extension +
                         " is not supported; what it adds is left out");
}

void load_buffer(gltf_file& file, const json& buffer, std::size_t index,
                 const std::optional<std::span<const uint8_t>>& binary) {
  auto place = fmt::format("buffers[{}]", index);
  if (!buffer.is_object()) fail(file, place, "must be an object");
  auto length = buffer.find("byteLength");
  if (length == buffer.end() || !length->is_number_unsigned())
    fail(file, place + ".byteLength", "is missing or no positive integer");
  auto size = length->get<uint64_t>();
  auto uri = get_string(buffer, "uri");
  std::span<const uint8_t> data;
  std::string where = "its data";
  if (uri.empty()) {
    // Uncompressed stand-ins of EXT_meshopt_compression may have no data.
    if (index != 0 || !binary) {
      auto extensions = buffer.find("extensions");
      if (extensions != buffer.end() && extensions->is_object() && !extensions->empty()) {
        file.buffers.emplace_back();
        return;
      }
      fail(file, place, "has no uri, and the file holds no binary chunk for it");
    }
    data = *binary;
    where = "the binary chunk";
  } else if (is_data_uri(uri)) {
    auto decoded = decode_data_uri(uri);
    if (!decoded) fail(file, place + ".uri", "is no valid base64 data URI");
    file.storage.push_back(std::move(*decoded));
    data = file.storage.back();
  } else {
    auto path = resolve_uri(file, uri, place + ".uri");
    file.storage.push_back(read_bytes(path, file.path.string(), place + ".uri"));
    data = file.storage.back();
    where = path.string();
    file.data_bytes += data.size();
  }
  if (data.size() < size)
    fail(file, place,
         fmt::format("wants {} bytes, but {} has only {}: it is truncated", size, where,
                     data.size()));
  file.buffers.push_back(data.first(static_cast<std::size_t>(size)));
}

void load_image_entry(gltf_file& file, const json& entry, std::size_t index) {
  auto place = fmt::format("images[{}]", index);
  if (!entry.is_object()) fail(file, place, "must be an object");
  gltf_image image;
  image.name = get_string(entry, "name");
  image.uri = get_string(entry, "uri");
  if (auto view = entry.find("bufferView"); view != entry.end() && view->is_number_integer()) {
    auto value = view->get<int64_t>();
    if (value < 0 || value > std::numeric_limits<int>::max())
      fail(file, place + ".bufferView", fmt::format("{} is out of range", value));
    image.buffer_view = static_cast<int>(value);
  }
  file.images.push_back(std::move(image));
}

void parse_model(gltf_file& file, const json& root, warning_list& warnings) {
  tinygltf::TinyGLTF parser;
  std::string text = root.dump(), errors, notes;
  if (text.size() > std::numeric_limits<unsigned>::max()) fail(file, "", "its JSON is too long");
  bool done = false;
  try {
    done = parser.LoadASCIIFromString(&file.model, &errors, &notes, text.data(),
                                      static_cast<unsigned>(text.size()), "");
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    errors += error.what();
  }
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < errors.size();) {
    auto end = std::min(errors.find('\n', begin), errors.size());
    if (end > begin) lines.push_back(errors.substr(begin, std::min<std::size_t>(end - begin, 300)));
    begin = end + 1;
  }
  if (!done) {
    for (const auto& extension : string_list(root, "extensionsUsed"))
      if (contains(compressions, extension))
        fail(file, "extensionsUsed", compression_reason(extension));
    fail(file, "", "is not valid glTF: " + (lines.empty() ? "unknown reason" : lines.back()));
  }
  for (const auto& line : lines) warnings.push_back(file.path.string() + ": " + line);
}

bool has_entries(const json& root, const char* key) {
  auto it = root.find(key);
  return it != root.end() && it->is_array() && !it->empty();
}

}  // namespace

void fail(const gltf_file& file, const std::string& place, const std::string& reason) {
  throw file_error{file.path.string(), place, reason};
}

std::vector<uint8_t> read_bytes(const fs::path& path, const std::string& file,
                                const std::string& place) {
  // In messages, name the other file when it is another.
  auto name = path.string() == file ? std::string{} : path.string() + ": ";
  std::error_code error;
  auto status = fs::status(path, error);
  if (!fs::exists(status)) throw file_error{file, place, name + "file not found"};
  if (!fs::is_regular_file(status)) throw file_error{file, place, name + "is not a regular file"};
  auto size = fs::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in) throw file_error{file, place, name + "cannot be opened for reading"};
  std::vector<uint8_t> bytes(static_cast<std::size_t>(size));
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (static_cast<std::size_t>(in.gcount()) != bytes.size())
    throw file_error{file, place, name + "cannot be read to its end"};
  return bytes;
}

bool is_data_uri(const std::string& uri) { return uri.compare(0, 5, "data:") == 0; }

std::optional<std::vector<uint8_t>> decode_data_uri(const std::string& uri) {
  constexpr std::string_view marker = ";base64,";
  auto start = uri.find(marker);
  if (!is_data_uri(uri) || start == std::string::npos) return {};
  auto text = std::string_view{uri}.substr(start + marker.size());
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  std::vector<uint8_t> result;
  result.reserve(text.size() / 4 * 3 + 2);
  uint32_t bits = 0;
  int count = 0;
  for (char c : text) {
    uint32_t value = 0;
    if (c >= 'A' && c <= 'Z')
      value = static_cast<uint32_t>(c - 'A');
    else if (c >= 'a' && c <= 'z')
      value = static_cast<uint32_t>(c - 'a') + 26;
    else if (c >= '0' && c <= '9')
      value = static_cast<uint32_t>(c - '0') + 52;
    else if (c == '+' || c == '-')
      value = 62;
    else if (c == '/' || c == '_')
      value = 63;
    else
      return {};
    bits = (bits << 6 | value) & 0xffffff;
    count += 6;
    if (count >= 8) {
      count -= 8;
      result.push_back(static_cast<uint8_t>(bits >> count));
    }
  }
  return result;
}

fs::path resolve_uri(const gltf_file& file, const std::string& uri, const std::string& place) {
  if (uri.find("://") != std::string::npos)
    fail(file, place, "'" + uri.substr(0, 200) + "' is a network address; only files are read");
  auto hex = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
  };
  std::string name;
  for (std::size_t i = 0; i < uri.size(); i++) {
    if (uri[i] == '%' && i + 2 < uri.size() && hex(uri[i + 1]) >= 0 && hex(uri[i + 2]) >= 0) {
      name += static_cast<char>(hex(uri[i + 1]) * 16 + hex(uri[i + 2]));
      i += 2;
    } else {
      name += uri[i];
    }
  }
  if (name.find('\0') != std::string::npos) fail(file, place, "is no valid file name");
  return file.path.parent_path() / fs::path(reinterpret_cast<const char8_t*>(name.c_str()));
}

gltf_file read_gltf_file(const fs::path& path, warning_list& warnings) {
  gltf_file file;
  file.path = path;
  file.bytes = read_bytes(path, path.string(), "");
  file.data_bytes = file.bytes.size();
  bool binary = file.bytes.size() >= 4 && std::memcmp(file.bytes.data(), "glTF", 4) == 0;
  glb_chunks chunks;
  if (binary)
    chunks = split_glb(file);
  else
    chunks.json = {reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size()};
  auto root = parse_json(file, chunks.json);
  check_header(file, root, warnings);

  auto take = [&](const char* key) {
    json list = json::array();
    if (auto it = root.find(key); it != root.end()) {
      if (!it->is_array()) fail(file, key, "must be an array");
      list = std::move(*it);
      root.erase(it);
    }
    return list;
  };
  auto buffers = take("buffers");
  file.storage.reserve(buffers.size());
  for (std::size_t i = 0; i < buffers.size(); i++) {
    load_buffer(file, buffers[i], i, chunks.binary);
    buffers[i] = nullptr;  // a data URI is no longer needed
  }
  auto images = take("images");
  for (std::size_t i = 0; i < images.size(); i++) load_image_entry(file, images[i], i);
  file.has_animations = has_entries(root, "animations");
  file.has_skins = has_entries(root, "skins");
  for (auto key : {"animations", "skins", "extras"}) root.erase(key);
  if (!binary) {
    file.bytes.clear();
    file.bytes.shrink_to_fit();
  }
  parse_model(file, root, warnings);
  return file;
}

}  // namespace wisp::gltf_detail
