// A converter of someone else: hair grown on a triangle, written, read again;
// and a file that is not there gives the error that is promised.

#include <cstdio>
#include <filesystem>

#include "wisp/scene/groom.h"
#include "wisp/scene/io.h"

int main() {
  wisp::shape_data scalp;
  scalp.positions = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}};
  scalp.triangles = {{0, 1, 2}};
  wisp::groom_params params;
  params.strands = 50;
  auto hair = wisp::grow_groom(scalp, params);

  wisp::warning_list warnings;
  std::filesystem::path path = "consumer-strands.ply";  // in the folder of this build
  wisp::save_shape(path, hair, warnings);
  auto again = wisp::load_shape(path, warnings);
  std::filesystem::remove(path);
  std::printf("%zu strands of %zu points\n", wisp::strand_count(again), again.positions.size());
  if (wisp::strand_count(again) != 50 || again.positions.size() != hair.positions.size()) return 1;

  try {
    wisp::load_json_scene("there-is-no-such-file.json", warnings);
  } catch (const wisp::file_error& error) {
    std::printf("as it should be: %s\n", error.what());
    return error.file.find("no-such-file") != std::string::npos ? 0 : 1;
  }
  return 1;
}
