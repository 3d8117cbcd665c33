// What a careless or hostile user tries: numbers that are none, names that
// clash, places that cannot be written.

#include <doctest/doctest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "run_command.h"
#include "wisp/render/image.h"

TEST_CASE("cli: numbers of options that are none or out of range are wrong use") {
  folder f;
  auto scene = simple_scene(f);
  for (const auto& [option, value] :
       std::vector<std::pair<std::string, std::string>>{{"--time", "nan"},
                                                        {"--time", "inf"},
                                                        {"--time", "0"},
                                                        {"--error", "nan"},
                                                        {"--error", "1e300"},
                                                        {"--error", "-1"},
                                                        {"--clamp", "nan"},
                                                        {"--clamp", "-1"},
                                                        {"--exposure", "nan"},
                                                        {"--exposure", "101"},
                                                        {"--seed", "-1"},
                                                        {"--seed", "99999999999999999999999"},
                                                        {"--seed", "1.5"},
                                                        {"--filter", "2"},
                                                        {"--filter", "lanczos"}}) {
    auto o = run(quick(scene, f / "a.exr") + std::vector<std::string>{option, value});
    CAPTURE(option);
    CAPTURE(o.err);
    CHECK(o.status == 2);
    CHECK(o.err.find(option) != std::string::npos);
    CHECK(o.err.size() < 200);  // no limits of three hundred digits
  }
  CHECK_FALSE(fs::exists(f.path / "a.exr"));
  for (const auto& [option, value] : std::vector<std::pair<std::string, std::string>>{
           {"--seed", "18446744073709551615"}, {"--filter", "Box"}, {"--exposure", "-1.5"}})
    CHECK(run(quick(scene, f / "a.exr") + std::vector<std::string>{option, value}).status == 0);
}

TEST_CASE("cli: a report replaces neither the scene nor an image") {
  folder f;
  auto scene = simple_scene(f);
  auto text = read_file(scene);
  auto args = quick(scene, f / "a.exr");
  CHECK(run(args + std::vector<std::string>{"--report", scene}).status == 2);
  CHECK(run(args + std::vector<std::string>{"--report", f / "./a.exr"}).status == 2);
  CHECK(read_file(scene) == text);
  CHECK_FALSE(fs::exists(f.path / "a.exr"));
}

TEST_CASE("cli: what cannot be saved is said before rendering") {
  folder f;
  auto scene = simple_scene(f);
  std::vector<std::string> long_run = {"--time", "2", "--resolution", "65536x1"};
  check_fault(f, quick(scene, "/proc/a.exr") + std::vector<std::string>{"--time", "1"},
              {"/proc/a.exr", "cannot be written"});
  check_fault(f, std::vector<std::string>{"render", scene, "-o", f / "a.jpg"} + long_run,
              {"a.jpg", "65500"});
  check_fault(
      f,
      std::vector<std::string>{"render", scene, "-o", f / (std::string(300, 'n') + ".exr")} +
          long_run,
      {"cannot be written"});
}

TEST_CASE("cli: long and odd names") {
  folder f;
  auto scene = simple_scene(f);
  std::string longest(251, 'n');
  auto o = run(quick(scene, f / (longest + ".exr")) +
               std::vector<std::string>{"-o", f / (longest + ".png")});
  CAPTURE(o.err);
  CHECK(o.status == 0);
  // Bytes that are no UTF-8, which JSON cannot hold.
  o = run(quick(scene, f / "a\xff.exr") + std::vector<std::string>{"--report", f / "r.json"});
  CHECK(o.status == 0);
  CHECK(nlohmann::json::parse(read_file(f / "r.json"))["samples"] == 4);
  fs::copy_file(f / "square.obj", f / "s\xff.obj");
  o = run({"info", f / "s\xff.obj", "--json"});
  CHECK(o.status == 0);
  CHECK(nlohmann::json::accept(o.out));
}

TEST_CASE("cli: an output that fails does not keep the others from being saved") {
  folder f;
  auto scene = simple_scene(f);
  // A folder takes the first output's name while the second is not yet saved.
  folder logs;
  pid_t pid = start({"render", scene, "-o", f / "a.exr", "-o", f / "b.exr", "--resolution", "24",
                     "--time", "3", "--quiet"},
                    logs.path / "out", logs.path / "err");
  sleep(1);
  fs::create_directories(f.path / "a.exr" / "taken");
  CHECK(finish(pid) == 1);
  CHECK(read_file(logs.path / "err").find("a.exr") != std::string::npos);
  CHECK(wisp::load_image(f / "b.exr").width == 24);
}

TEST_CASE("cli: the error of one sample is not known") {
  folder f;
  auto scene = simple_scene(f);
  auto o = run({"render", scene, "-o", f / "a.exr", "--resolution", "24", "--samples", "1",
                "--report", f / "r.json"});
  CHECK(o.status == 0);
  CHECK(o.out.find("1 sample in") != std::string::npos);
  CHECK(o.out.find("error unknown") != std::string::npos);
  CHECK(nlohmann::json::parse(read_file(f / "r.json"))["error"].is_null());
}

TEST_CASE("cli: more threads than the machine has are as many as it has, without noise") {
  folder f;
  auto scene = simple_scene(f);
  auto o =
      run(quick(scene, f / "a.exr") + std::vector<std::string>{"--threads", "4096", "--quiet"});
  CHECK(o.status == 0);
  CHECK(o.err.empty());
}

TEST_CASE("cli: an empty scene is named") {
  folder f;
  check_fault(f, quick(f.write("empty.json", "{}"), f / "a.exr"),
              {"empty.json: nothing to render"});
}
