// libFuzzer target for the strand readers: the first byte picks the format, the
// rest is the file. What can be read is written again in all three formats.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "../../libs/scene/src/shape_formats.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  using namespace wisp;
  if (size == 0) return 0;
  constexpr std::array readers = {read_hair, read_tfx, read_tfxmesh, read_pbrt_curves};
  warning_list warnings;
  shape_data shape;
  try {
    shape = readers[data[0] % readers.size()](std::span(data + 1, size - 1), "fuzz", warnings);
  } catch (const file_error&) {
    return 0;
  }
  for (auto write : {write_hair, write_tfx, write_pbrt_curves}) {
    try {
      write(shape, "fuzz", warnings);
    } catch (const file_error&) {
    }
  }
  return 0;
}
