// Accessors of glTF: typed arrays in buffers, strided, normalised or sparse.
// glTF 2.0 specification, section 3.6.2. Every range is checked against the
// buffer before memory is set aside.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "gltf_internal.h"

namespace wisp::gltf_detail {

namespace {

std::size_t component_size(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_INT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    case TINYGLTF_COMPONENT_TYPE_DOUBLE:
      return 8;
    default:
      return 0;
  }
}

const tinygltf::Accessor& get_accessor(const gltf_file& file, int accessor,
                                       const std::string& place) {
  const auto& accessors = file.model.accessors;
  if (accessor < 0 || static_cast<std::size_t>(accessor) >= accessors.size())
    fail(file, place,
         fmt::format("accessor {} does not exist; the file has {}", accessor, accessors.size()));
  return accessors[static_cast<std::size_t>(accessor)];
}

// `count` elements of `size` bytes, each `stride` after the one before.
struct strided {
  const uint8_t* data = nullptr;
  std::size_t stride = 0;
};

strided get_elements(const gltf_file& file, int view, std::size_t offset, std::size_t count,
                     std::size_t size, bool allow_stride, const std::string& place) {
  auto bytes = view_bytes(file, view, place);
  if (size == 0) fail(file, place, "its component type is not one of glTF's");
  std::size_t stride = file.model.bufferViews[static_cast<std::size_t>(view)].byteStride;
  if (stride == 0 || !allow_stride) stride = size;
  bool fits = count == 0 || (offset <= bytes.size() && size <= bytes.size() - offset &&
                             (count - 1) <= (bytes.size() - offset - size) / stride);
  if (!fits)
    fail(file, place,
         fmt::format("{} elements of {} bytes from byte {} on do not fit into buffer view {} of {} "
                     "bytes: the file is corrupt",
                     count, size, offset, view, bytes.size()));
  return {count == 0 ? nullptr : bytes.data() + offset, stride};
}

// Calls f(zero of the component's type).
template <typename F>
void with_component_type(const gltf_file& file, int type, const std::string& place, F&& f) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return f(int8_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return f(uint8_t{});
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return f(int16_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return f(uint16_t{});
    case TINYGLTF_COMPONENT_TYPE_INT:
      return f(int32_t{});
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return f(uint32_t{});
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return f(float{});
    case TINYGLTF_COMPONENT_TYPE_DOUBLE:
      return f(double{});
    default:
      fail(file, place, fmt::format("component type {} is not one of glTF's", type));
  }
}

template <typename T>
T load(const uint8_t* p) {
  T value;
  std::memcpy(&value, p, sizeof(T));  // glTF is little endian, and so is what we run on
  return value;
}

template <typename T>
float to_float(T value, bool normalized) {
  if constexpr (std::is_integral_v<T>) {
    if (normalized)
      return std::max(static_cast<float>(static_cast<double>(value) /
                                         static_cast<double>(std::numeric_limits<T>::max())),
                      -1.0f);
  } else if constexpr (std::is_same_v<T, double>) {
    // A double too large for a float would be undefined to convert.
    if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max()))
      return value > 0 ? infinity : -infinity;
  }
  return static_cast<float>(value);
}

template <typename T>
void convert(const strided& from, std::size_t count, std::size_t components, bool normalized,
             float* to) {
  for (std::size_t i = 0; i < count; i++)
    for (std::size_t c = 0; c < components; c++)
      to[i * components + c] =
          to_float(load<T>(from.data + i * from.stride + c * sizeof(T)), normalized);
}

// The elements that a sparse accessor replaces: their indices.
std::vector<uint32_t> sparse_indices(const gltf_file& file, const tinygltf::Accessor& accessor,
                                     const std::string& place) {
  const auto& sparse = accessor.sparse;
  // The offsets are int or size_t, as tinygltf's version goes.
  constexpr auto largest = static_cast<std::size_t>(std::numeric_limits<int>::max());
  auto offset_fits = [&](auto offset) { return static_cast<std::size_t>(offset) <= largest; };
  if (sparse.count < 0 || static_cast<std::size_t>(sparse.count) > accessor.count ||
      !offset_fits(sparse.indices.byteOffset) || !offset_fits(sparse.values.byteOffset))
    fail(file, place, "its sparse part is out of range");
  auto count = static_cast<std::size_t>(sparse.count);
  auto where = place + ".sparse.indices";
  auto elements = get_elements(file, sparse.indices.bufferView,
                               static_cast<std::size_t>(sparse.indices.byteOffset), count,
                               component_size(sparse.indices.componentType), false, where);
  std::vector<uint32_t> indices(count);
  with_component_type(file, sparse.indices.componentType, where, [&](auto zero) {
    using T = decltype(zero);
    if constexpr (std::is_unsigned_v<T>) {
      for (std::size_t i = 0; i < count; i++) indices[i] = load<T>(elements.data + i * sizeof(T));
    } else {
      fail(file, where, "must be of an unsigned integer type");
    }
  });
  for (auto index : indices)
    if (index >= accessor.count)
      fail(file, where,
           fmt::format("{} is out of range: the accessor has {} elements", index, accessor.count));
  return indices;
}

}  // namespace

std::span<const uint8_t> view_bytes(const gltf_file& file, int view, const std::string& place) {
  const auto& views = file.model.bufferViews;
  if (view < 0 || static_cast<std::size_t>(view) >= views.size())
    fail(file, place,
         fmt::format("buffer view {} does not exist; the file has {}", view, views.size()));
  const auto& v = views[static_cast<std::size_t>(view)];
  auto where = fmt::format("bufferViews[{}]", view);
  if (v.buffer < 0 || static_cast<std::size_t>(v.buffer) >= file.buffers.size())
    fail(file, where,
         fmt::format("buffer {} does not exist; the file has {}", v.buffer, file.buffers.size()));
  auto buffer = file.buffers[static_cast<std::size_t>(v.buffer)];
  if (v.byteOffset > buffer.size() || v.byteLength > buffer.size() - v.byteOffset)
    fail(file, where,
         fmt::format("bytes {} to {} + {} go beyond the end of buffer {} of {} bytes", v.byteOffset,
                     v.byteOffset, v.byteLength, v.buffer, buffer.size()));
  return buffer.subspan(v.byteOffset, v.byteLength);
}

int accessor_components(const gltf_file& file, int accessor, const std::string& place) {
  switch (get_accessor(file, accessor, place).type) {
    case TINYGLTF_TYPE_SCALAR:
      return 1;
    case TINYGLTF_TYPE_VEC2:
      return 2;
    case TINYGLTF_TYPE_VEC3:
      return 3;
    case TINYGLTF_TYPE_VEC4:
    case TINYGLTF_TYPE_MAT2:
      return 4;
    case TINYGLTF_TYPE_MAT3:
      return 9;
    default:
      return 16;
  }
}

std::vector<float> read_floats(const gltf_file& file, int index, int components,
                               const std::string& place) {
  const auto& accessor = get_accessor(file, index, place);
  auto where = fmt::format("accessors[{}]", index);
  int has = accessor_components(file, index, place);
  if (has != components)
    fail(file, place,
         fmt::format("accessor {} has {} components, where {} are wanted", index, has, components));
  auto per = static_cast<std::size_t>(components);
  std::size_t size = component_size(accessor.componentType) * per;
  strided elements;
  if (accessor.bufferView >= 0) {
    elements = get_elements(file, accessor.bufferView, accessor.byteOffset, accessor.count, size,
                            true, where);
  } else if (accessor.count > std::max<std::size_t>(1 << 16, file.data_bytes)) {
    // Zeros need no bytes in the file; this keeps a corrupt count from asking
    // for all of the memory.
    fail(file, where + ".count",
         fmt::format("{} elements without a buffer view are more than the file has bytes",
                     accessor.count));
  }
  std::vector<float> result(accessor.count * per, 0.0f);
  with_component_type(file, accessor.componentType, where, [&](auto zero) {
    if (elements.data)
      convert<decltype(zero)>(elements, accessor.count, per, accessor.normalized, result.data());
  });
  if (accessor.sparse.isSparse) {
    auto indices = sparse_indices(file, accessor, where);
    auto values = get_elements(file, accessor.sparse.values.bufferView,
                               static_cast<std::size_t>(accessor.sparse.values.byteOffset),
                               indices.size(), size, false, where + ".sparse.values");
    with_component_type(file, accessor.componentType, where, [&](auto zero) {
      for (std::size_t i = 0; i < indices.size(); i++)
        convert<decltype(zero)>({values.data + i * size, size}, 1, per, accessor.normalized,
                                result.data() + indices[i] * per);
    });
  }
  return result;
}

std::vector<uint32_t> read_indices(const gltf_file& file, int index, const std::string& place) {
  const auto& accessor = get_accessor(file, index, place);
  auto where = fmt::format("accessors[{}]", index);
  if (accessor.type != TINYGLTF_TYPE_SCALAR)
    fail(file, place, fmt::format("accessor {} must be of scalars to hold indices", index));
  if (accessor.bufferView < 0 || accessor.sparse.isSparse)
    fail(file, where, "indices without a buffer view, or sparse ones, are not supported");
  std::vector<uint32_t> indices;
  with_component_type(file, accessor.componentType, where, [&](auto zero) {
    using T = decltype(zero);
    if constexpr (std::is_unsigned_v<T>) {
      auto elements = get_elements(file, accessor.bufferView, accessor.byteOffset, accessor.count,
                                   sizeof(T), true, where);
      indices.resize(accessor.count);
      for (std::size_t i = 0; i < indices.size(); i++)
        indices[i] = load<T>(elements.data + i * elements.stride);
    } else {
      fail(file, where + ".componentType", "indices must be of an unsigned integer type");
    }
  });
  return indices;
}

}  // namespace wisp::gltf_detail
