// What a wisp without the render component says of what it cannot do.

#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "run_command.h"

TEST_CASE("cli: what needs the render component is told of in one sentence") {
  const std::string sentence =
      "needs the render component; this wisp is built without it (configure with "
      "-DWISP_BUILD_RENDER=ON to have it)";
  folder f;
  const auto scene = f.write("scene.json", R"({
    "textures": [{"name": "wood", "uri": "wood.png"}],
    "shapes": [{"name": "t", "uri": "t.obj"}],
    "solids": [{"name": "s", "sdf": {"sphere": {"radius": 1}}}],
    "problems": [{"name": "p", "domain": "s", "boundary": "x"},
                 {"name": "painted", "domain": "t", "boundary": {"texture": "wood"}},
                 {"name": "plate", "domain": "t", "equation": "biharmonic", "boundary": 0,
                  "boundary_laplacian": {"texture": 0}}],
    "sections": [{"name": "cut", "problem": "p", "resolution": 8}]})");
  f.write("t.obj",
          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\n"
          "f 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 1/1 4/1 3/1\nf 2/1 3/1 4/1\n");
  const auto points = f.write("p.csv", "x,y,z\n0.1,0.1,0.1\n");
  const auto files = f.files();
  const std::vector<std::pair<std::vector<std::string>, std::string>> uses = {
      {{"render", scene, "-o", f / "a.png"}, "these commands work: solve, "},
      {{"render"}, "'render'"},
      {{"solve", scene, "-o", f / "a.csv", "-o", f / "a.png"}, "a.png"},
      {{"solve", scene, "-o", f / "A.EXR"}, ".csv and .vti"},
      {{"study", scene, "-o", f / "s", "--picture", "--no-plots"}, "scene.json"}};
  for (const auto& [args, words] : uses) {
    auto o = run(args);
    CAPTURE(o.err);
    CHECK(o.status == 2);
    CHECK(o.err.find(sentence) != std::string::npos);
    CHECK(o.err.find(words) != std::string::npos);
    CHECK(std::count(o.err.begin(), o.err.end(), '\n') == 1);
  }
  CHECK(f.files() == files);
  check_fault(f, {"solve", scene, "--problem", "painted", "--points", points, "-o", f / "u.csv"},
              {"scene.json: problems[1].boundary.texture: ", "'wood'", sentence});
  check_fault(f, {"solve", scene, "--problem", "plate", "--points", points, "-o", f / "u.csv"},
              {"scene.json: problems[2].boundary_laplacian.texture: ", "'wood'", sentence});
  CHECK(run({"study", scene, "-o", f / "s", "--no-plots", "--points", points, "--budgets", "16,32"})
            .status == 0);
  CHECK(fs::exists(f.path / "s" / "study.json"));
  const auto gltf = f.write("a.glTF", R"({"asset": {"version": "2.0"}})");
  check_fault(f, {"info", gltf}, {"a.glTF", sentence});
  check_fault(f, {"convert", gltf, f / "a.ply"}, {"a.glTF", sentence});
  check_fault(f, {"info", f.write("a.txt", "")}, {"'.txt'", "not known"});
  check_fault(f, {"info", f / "absent.ply"}, {"absent.ply", "not found"});
  check_fault(f, {"info", f.path.string()}, {"is a folder"});
}
