// wisp solve as a user meets it.

#include <doctest/doctest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "run_command.h"

namespace {

// A table by the names of its columns.
struct table {
  std::vector<std::string> names;
  std::map<std::string, std::vector<double>> columns;
  std::size_t rows = 0;
};

table read_table(const std::string& path) {
  table t;
  std::istringstream text(read_file(path));
  std::string line, field;
  std::getline(text, line);
  std::istringstream header(line);
  while (std::getline(header, field, ',')) t.names.push_back(field);
  while (std::getline(text, line)) {
    std::istringstream row(line);
    std::size_t i = 0;
    while (std::getline(row, field, ',')) {
      REQUIRE(i < t.names.size());
      t.columns[t.names[i++]].push_back(std::stod(field));
    }
    REQUIRE(i == t.names.size());
    ++t.rows;
  }
  return t;
}

// Unit balls with problems of known solutions.
std::string ball_scene(const folder& f) {
  return f.write("ball.json", R"({
    "solids": [{"name": "ball", "sdf": {"sphere": {"radius": 1}}}],
    "problems": [
      {"name": "linear", "domain": "ball", "boundary": "1 + x + 2*y - z", "exact": "1 + x + 2*y - z"},
      {"name": "torsion", "domain": "ball", "equation": "poisson", "boundary": 0, "source": "-6",
       "exact": "1 - x^2 - y^2 - z^2"},
      {"name": "vector", "domain": "ball", "boundary": ["x", "y"], "exact": ["x", "y"]},
      {"name": "outside", "domain": "ball", "side": "exterior", "boundary": "3", "infinity": 1,
       "exact": "2/sqrt(x^2 + y^2 + z^2) + 1"},
      {"name": "plate", "domain": "ball", "equation": "biharmonic", "boundary": "1",
       "boundary_laplacian": "6", "exact": "x^2 + y^2 + z^2"},
      {"name": "broken", "domain": "ball", "boundary": "sqrt(x) + 0"}],
    "sections": [
      {"name": "cut", "problem": "linear", "resolution": 16},
      {"name": "a", "problem": "torsion", "resolution": 8},
      {"name": "b", "problem": "torsion", "resolution": 8, "normal": [0, 1, 0]},
      {"name": "off", "problem": "vector", "origin": [0, 0, 5]}]})");
}

std::string some_points(const folder& f) {
  return f.write(
      "points.csv",
      "# where\nname,z, x ,\"Y\"\r\na,0.5,0,0.25\n\nb,-0.25,0.125,0\nc,0,3,0\nd,nan,0,0\n"
      "e,0,0,0\n");
}

using args = std::vector<std::string>;

}  // namespace

TEST_CASE("cli solve: values at points are right and rows tell what is outside") {
  folder f;
  const auto scene = ball_scene(f), points = some_points(f);
  auto o = run({"solve", scene, "--points", points, "--walks", "400", "--gradient", "-o",
                f / "u.csv", "--report", f / "r.json"});
  CAPTURE(o.err);
  REQUIRE(o.status == 0);
  CHECK(o.err.find("2 of 5 points are nan, as they are not in the domain") != std::string::npos);
  CHECK(o.out.find("u.csv") != std::string::npos);
  auto t = read_table(f / "u.csv");
  CHECK(t.names == std::vector<std::string>{"x", "y", "z", "value", "std_error", "walks",
                                            "mean_steps", "gx", "gy", "gz", "gx_error", "gy_error",
                                            "gz_error", "exact"});
  REQUIRE(t.rows == 5);
  CHECK(t.columns["y"][0] == 0.25);
  CHECK(t.columns["x"][1] == 0.125);
  CHECK(t.columns["exact"][0] == 1);
  for (std::size_t i : {0u, 1u, 4u}) {
    CAPTURE(i);
    CHECK(std::abs(t.columns["value"][i] - t.columns["exact"][i]) <
          6 * t.columns["std_error"][i] + 1e-3);
    CHECK(t.columns["std_error"][i] < 0.2);
    CHECK(t.columns["walks"][i] == 400);
    CHECK(t.columns["mean_steps"][i] >= 1);
    const double g[3] = {1, 2, -1};
    const char* names[3] = {"gx", "gy", "gz"};
    for (int k = 0; k < 3; k++)
      CHECK(std::abs(t.columns[names[k]][i] - g[k]) <
            6 * t.columns[std::string(names[k]) + "_error"][i] + 1e-2);
  }
  for (std::size_t i : {2u, 3u})
    for (const auto& name : t.names) {
      CAPTURE(name);
      if (name == "walks") {
        CHECK(t.columns[name][i] == 0);
      } else if (name.size() > 1) {
        CHECK(std::isnan(t.columns[name][i]));
      }
    }
  auto report = nlohmann::json::parse(read_file(f / "r.json"));
  CHECK(report["walks"] == 1200);
  CHECK(report["points"] == 5);
  CHECK(report["outside"] == 2);
  CHECK(report["unfinished"] == 0);
  CHECK(report["error"].get<double>() > 0);
  CHECK(report["rmse"].get<double>() < 0.2);
  CHECK(report["seconds"].contains("solve"));
  CHECK(report["peak_memory_bytes"].get<double>() > 1e6);
  CHECK(report["warnings"].size() == 1);
  bool tree = false;
  for (const auto& part : report["parts"]) {
    CHECK_FALSE(part["why"].get<std::string>().empty());
    if (part["name"] != "distance tree") continue;
    tree = true;
    CHECK_FALSE(part["built"].get<bool>());
  }
  CHECK(tree);
}

TEST_CASE("cli solve: each problem with each estimator finds the solution") {
  folder f;
  const auto scene = ball_scene(f);
  const auto inner = f.write("in.csv", "x,y,z\n0,0,0\n0.5,0.25,-0.125\n0,-0.75,0\n");
  const auto outer = f.write("out.csv", "x,y,z\n0,0,1.5\n3,1,-2\n");
  const std::vector<std::pair<std::string, args>> cases = {
      {"torsion", {}},
      {"torsion", {"--estimator", "uniform,random,plain"}},
      {"torsion", {"--estimator", "antithetic", "--estimator", "control_variates"}},
      {"outside", {}},
      {"outside", {"--estimator", "roulette"}},
      {"plate", {}},
      {"plate", {"--estimator", "tree"}},
      {"plate", {"--estimator", "nested"}},
  };
  for (const auto& [problem, more] : cases) {
    CAPTURE(problem);
    CAPTURE((more.empty() ? "" : more[1]));
    args a = {"solve",    scene,      "--problem",
              problem,    "--points", problem == "outside" ? outer : inner,
              "--walks",  "2000",     "-o",
              f / "u.csv"};
    a.insert(a.end(), more.begin(), more.end());
    auto o = run(a);
    CAPTURE(o.err);
    REQUIRE(o.status == 0);
    CHECK(o.err.empty());
    auto t = read_table(f / "u.csv");
    for (std::size_t i = 0; i < t.rows; i++)
      CHECK(std::abs(t.columns["value"][i] - t.columns["exact"][i]) <
            6 * t.columns["std_error"][i] + 2e-3);
  }
  // several channels
  auto o = run(
      {"solve", scene, "--problem", "vector", "--points", inner, "--gradient", "-o", f / "v.csv"});
  REQUIRE(o.status == 0);
  auto t = read_table(f / "v.csv");
  CHECK(t.names == std::vector<std::string>{
                       "x",           "y",           "z",          "value_0",    "value_1",
                       "std_error_0", "std_error_1", "walks",      "mean_steps", "gx_0",
                       "gx_1",        "gy_0",        "gy_1",       "gz_0",       "gz_1",
                       "gx_error_0",  "gx_error_1",  "gy_error_0", "gy_error_1", "gz_error_0",
                       "gz_error_1",  "exact_0",     "exact_1"});
  CHECK(std::abs(t.columns["value_1"][2] + 0.75) < 0.3);
  CHECK(t.columns["walks"][0] == 64);
}

TEST_CASE("cli solve: sections in every format and the same at any number of threads") {
  folder f;
  const auto scene = ball_scene(f);
  std::vector<std::string> files = {"a.csv", "a.vti"};
  if (has_render) files.insert(files.end(), {"a.png", "a.exr"});
  args command = {"solve", scene, "--walks", "16", "--threads", "1", "--report", f / "r.json"};
  for (const auto& name : files) command = command + args{"-o", f / name};
  auto o = run(command);
  CAPTURE(o.err);
  REQUIRE(o.status == 0);
  auto report = nlohmann::json::parse(read_file(f / "r.json"));
  CHECK(report["section"] == "cut");
  auto t = read_table(f / "a.csv");
  CHECK(t.rows == report["points"].get<std::size_t>());
  CHECK(t.rows > 100);
  CHECK(t.rows < 256);
  for (std::size_t i = 0; i < t.rows; i++) CHECK(t.columns["z"][i] == 0);
  for (const auto& name : files) CHECK(fs::file_size(f.path / name) > 500);
  CHECK(run({"solve", scene, "--walks", "16", "-o", f / "b.csv", "--threads", "3"}).status == 0);
  CHECK(read_file(f / "a.csv") == read_file(f / "b.csv"));
  CHECK(run({"solve", scene, "--walks", "16", "-o", f / "c.csv", "--seed", "1"}).status == 0);
  CHECK(read_file(f / "a.csv") != read_file(f / "c.csv"));
  CHECK(run({"solve", scene, "--section", "b", "--estimator", "independent", "-o", f / "d.csv"})
            .status == 0);
  auto d = read_table(f / "d.csv");
  for (std::size_t i = 0; i < d.rows; i++) CHECK(d.columns["y"][i] == 0);
}

TEST_CASE("cli solve: the scenes that ship with the project") {
  int solved = 0;
  for (const auto& entry : fs::directory_iterator(WISP_TEST_SCENES)) {
    const std::string scene = entry.path().string(), name = entry.path().stem().string();
    if (entry.path().extension() != ".json" || name.rfind("pde-", 0) != 0) continue;
    CAPTURE(name);
    folder f;
    auto info = run({"info", scene, "--json", "--quiet"});
    REQUIRE(info.status == 0);
    const auto described = nlohmann::json::parse(info.out);
    for (const auto& section : described["sections"]) {
      auto o = run({"solve", scene, "--section", section["name"], "--walks", "1", "-o", f / "u.csv",
                    "-o", f / "u.vti", "--report", f / "r.json", "--quiet"});
      CAPTURE(o.err);
      CHECK(o.status == 0);
      auto report = nlohmann::json::parse(read_file(f / "r.json"));
      const auto points = report["points"].get<std::ptrdiff_t>();
      CHECK(points > 1000);
      CHECK(report["undefined"].get<std::ptrdiff_t>() < points / 2);
      CHECK(report["error"].get<double>() > 0);
      const auto table = read_file(f / "u.csv");
      CHECK(std::count(table.begin(), table.end(), '\n') == points + 1);
      CHECK(read_file(f / "u.vti").find("<VTKFile type=\"ImageData\"") != std::string::npos);
      ++solved;
    }
  }
  CHECK(solved >= 6);
}

TEST_CASE("cli solve: budgets") {
  folder f;
  const auto scene = ball_scene(f);
  const auto points = f.write("p.csv", "x,y,z\n0,0,0\n0.5,0,0\n");
  auto o = run({"solve", scene, "--points", points, "--error", "0.01", "-o", f / "e.csv"});
  CAPTURE(o.err);
  CHECK(o.status == 0);
  auto t = read_table(f / "e.csv");
  for (std::size_t i = 0; i < t.rows; i++) CHECK(t.columns["std_error"][i] < 0.0101);
  const auto start = std::chrono::steady_clock::now();
  o = run({"solve", scene, "--problem", "outside", "--points", f.write("q.csv", "x,y,z\n2,0,0\n"),
           "--time", "0.3", "-o", f / "t.csv"});
  CHECK(o.status == 0);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  CHECK(seconds < 20);
  CHECK(read_table(f / "t.csv").columns["walks"][0] > 64);
}

TEST_CASE("cli solve: a cap holds for budgets, and is no demand") {
  folder f;
  const auto scene = ball_scene(f);
  const auto points = f.write("p.csv", "x,y,z\n0,0,0\n0.5,0,0\n");
  const auto most_walks = [&](const args& more) {
    auto o = run(args{"solve", scene, "--points", points, "-o", f / "u.csv"} + more);
    CAPTURE(o.err);
    REQUIRE(o.status == 0);
    auto t = read_table(f / "u.csv");
    return std::max(t.columns["walks"][0], t.columns["walks"][1]);
  };
  for (const char* walks : {"1", "5", "10", "33", "100"}) {
    CAPTURE(walks);
    for (const char* first : {"random", "antithetic", "stratified"}) {
      const double most = std::stod(walks);
      CHECK(most_walks({"--walks", walks, "--error", "1e-9", "--estimator", first}) <= most);
      CHECK(most_walks({"--walks", walks, "--time", "5", "--estimator", first}) <= most);
    }
  }
  CHECK(most_walks({"--walks", "1000000", "--error", "0.5"}) < 200);
  CHECK(most_walks({"--walks", "1000", "--error", "1e-9"}) > 980);
}

TEST_CASE("cli solve: names that are given twice are warned of") {
  folder f;
  const auto scene = f.write("twice.json", R"({
    "solids": [{"name": "s", "sdf": {"sphere": {"radius": 1}}}],
    "problems": [{"name": "p", "domain": "s", "boundary": 1},
                 {"name": "p", "domain": "s", "boundary": 2},
                 {"domain": "s", "boundary": 3}, {"domain": "s", "boundary": 4}],
    "sections": [{"name": "c", "problem": 0, "resolution": 4},
                 {"name": "c", "problem": 1, "resolution": 4}]})");
  auto o = run({"solve", scene, "--problem", "p", "--section", "c", "-o", f / "u.csv"});
  CHECK(o.status == 0);
  CHECK(o.err.find("twice.json: problems[1].name: 'p' is the name of problems[0] too") !=
        std::string::npos);
  CHECK(o.err.find("twice.json: sections[1].name: 'c' is the name of sections[0] too") !=
        std::string::npos);
  CHECK(std::count(o.err.begin(), o.err.end(), '\n') == 2);
  CHECK(read_table(f / "u.csv").columns["value"][0] == doctest::Approx(1));
}

TEST_CASE("cli solve: sections beyond what numbers can tell apart are refused") {
  folder f;
  const auto solve = [&](const std::string& section, bool exterior = false) {
    return args{"solve",
                f.write("s.json", R"({"solids": [{"name": "s", "sdf": {"sphere": {"radius": 1}}}],
      "problems": [{"name": "p", "domain": "s", "boundary": 1, "side": ")" +
                                      std::string(exterior ? "exterior" : "interior") +
                                      R"("}], "sections": [{"problem": 0, "resolution": 8, )" +
                                      section + "}]}"),
                "-o", f / "u.csv"};
  };
  f.write("s.json", "");
  for (const bool exterior : {false, true}) {
    check_fault(f, solve(R"("size": 1e30)", exterior), {"sections[0]: ", "size", "1e9 times"});
    check_fault(f, solve(R"("size": [1, 1e30])", exterior), {"sections[0]: ", "size", "1e9 times"});
    check_fault(f, solve(R"("origin": [1e30, 0, 0])", exterior),
                {"sections[0]: ", "origin", "1e9 times"});
    check_fault(f, solve(R"("origin": [1e30, 0, 0], "size": 1)", exterior),
                {"sections[0]: ", "origin", "1e9 times"});
    check_fault(f, solve(R"("origin": [0.5, 0, 0], "size": 1e-30)", exterior),
                {"sections[0]: ", "rounding of coordinates"});
  }
  check_fault(f, solve(R"("size": 1e6)"), {"sections[0]: ", "cells are larger than the domain"});
  CHECK(run(solve(R"("size": 1e6)", true)).status == 0);
  CHECK(run(solve(R"("size": 1e-6)")).status == 0);
}

TEST_CASE("cli solve: domains without an inside are an error, not a table of nan") {
  folder f;
  f.write("tilted.obj", "v 0 0 0\nv 1 0 0.3\nv 0 1 0.7\nv 1 1 1\nf 1 2 3\nf 2 4 3\n");
  f.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\n");
  const auto scene = f.write("scene.json", R"({
    "shapes": [{"name": "tilted", "uri": "tilted.obj"}, {"name": "open", "uri": "open.obj"}],
    "solids": [{"name": "eaten", "sdf": {"difference": [{"sphere": {"radius": 1}},
                                                        {"sphere": {"radius": 1.1}}]}},
               {"name": "apart", "sdf": {"intersection": [{"box": {"half": [1, 1, 1]}},
                  {"sphere": {"center": [1.6, 1.6, 1.6], "radius": 1}}]}},
               {"name": "shell", "sdf": {"difference": [{"sphere": {"radius": 1}},
                                                        {"sphere": {"radius": 0.999}}]}}],
    "problems": [{"name": "eaten", "domain": "eaten", "boundary": 1},
                 {"name": "apart", "domain": "apart", "boundary": 1},
                 {"name": "tilted", "domain": "tilted", "boundary": 1},
                 {"name": "shell", "domain": "shell", "boundary": 1},
                 {"name": "open", "domain": "open", "boundary": 1},
                 {"name": "around", "domain": "tilted", "side": "exterior", "boundary": 1}]})");
  const auto points = f.write("p.csv", "x,y,z\n0.1,0.2,5\n0.3,0.3,0.4\n");
  const auto solve = [&](const std::string& problem) {
    return args{"solve", scene, "--problem", problem,  "--points",
                points,  "-o",  f / "u.csv", "--quiet"};
  };
  check_fault(f, solve("eaten"), {"scene.json: problems[0].domain: has no inside"});
  check_fault(f, solve("apart"), {"scene.json: problems[1].domain: has no inside"});
  check_fault(f, solve("tilted"), {"scene.json: problems[2].domain: has no inside", "flat"});
  for (const char* problem : {"shell", "open", "around"}) {
    CAPTURE(problem);
    CHECK(run(solve(problem)).status == 0);
    CHECK(std::isnan(read_table(f / "u.csv").columns["value"][0]) ==
          (problem != std::string("around")));
  }
}

TEST_CASE("cli solve: warnings of what is not known") {
  folder f;
  const auto scene = ball_scene(f);
  const auto points = f.write("p.csv", "x,y,z\n0,0,0\n");
  auto o = run({"solve", scene, "--problem", "broken", "--points", points, "-o", f / "u.csv"});
  CHECK(o.status == 0);
  CHECK(o.err.find("1 of 1 points are nan, as walks met values") != std::string::npos);
  auto t = read_table(f / "u.csv");
  CHECK(std::isnan(t.columns["value"][0]));
  CHECK(t.columns["walks"][0] > 0);
  const auto off = f.write("off.csv", "x,y,z\n0.9,0.1,0\n");
  o = run({"solve", scene, "--points", off, "--max-steps", "1", "-o", f / "m.csv"});
  CHECK(o.status == 0);
  CHECK(o.err.find("walks did not end at the boundary within 1 steps") != std::string::npos);
  o = run({"solve", scene, "--points", off, "--estimator", "tree,roulette", "-o", f / "m.csv"});
  CHECK(o.status == 0);
  CHECK(o.err.find("--estimator tree: the problem is not biharmonic; ignored") !=
        std::string::npos);
  o = run({"solve", scene, "--points", off, "--max-steps", "1", "--quiet", "-o", f / "m.csv"});
  CHECK(o.err.empty());
  CHECK(o.out.empty());
}

TEST_CASE("cli solve: wrong use") {
  folder f;
  const auto scene = ball_scene(f), points = some_points(f);
  const auto bare =
      f.write("bare.json", R"({"solids": [{"name": "s", "sdf": {"sphere": {"radius": 1}}}],
    "problems": [{"name": "p", "domain": "s", "boundary": "x"}]})");
  const auto files = f.files();
  const std::vector<std::pair<args, std::string>> cases = {
      {{scene}, "output"},
      {{scene, "-o", f / "a.jpg"}, "must end in .csv"},
      {{scene, "--points", points, "-o", f / "a.png"}, "shows a section"},
      {{scene, "--points", points, "--section", "cut", "-o", f / "a.csv"}, "exclude each other"},
      {{scene, "--problem", "none", "-o", f / "a.csv"}, "no problem 'none'; it has: linear"},
      {{scene, "--section", "none", "-o", f / "a.csv"}, "no section 'none'; it has: cut"},
      {{scene, "--problem", "torsion", "-o", f / "a.csv"}, "2 sections"},
      {{scene, "--problem", "torsion", "--section", "cut", "-o", f / "a.csv"}, "cuts the problem"},
      {{scene, "--problem", "plate", "-o", f / "a.csv"}, "no section of the problem 'plate'"},
      {{bare, "-o", f / "a.csv"}, "--points"},
      {{scene, "-o", f / "a.csv", "--estimator", "magic"}, "no estimator 'magic', but these"},
      {{scene, "-o", f / "a.csv", "--estimator", "tree,nested"}, "exclude each other"},
      {{scene, "-o", f / "a.csv", "--walks", "0"}, "--walks"},
      {{scene, "-o", f / "a.csv", "--walks", "-1"}, "--walks"},
      {{scene, "-o", f / "a.csv", "--epsilon", "0"}, "--epsilon"},
      {{scene, "-o", f / "a.csv", "--epsilon", "nan"}, "--epsilon"},
      {{scene, "-o", f / "a.csv", "--max-steps", "0"}, "--max-steps"},
      {{scene, "-o", f / "a.csv", "--time", "0"}, "--time"},
      {{scene, "-o", f / "a.csv", "--error", "-1"}, "--error"},
      {{scene, "-o", scene}, "must end in"},
      {{scene, "--points", points, "-o", points}, "holds the points"},
      {{scene, "-o", f / "a.csv", "-o", f / "a.csv"}, "given twice"},
      {{scene, "-o", f / "a.csv", "--report", scene}, "the scene itself"}};
  for (const auto& [more, words] : cases) {
    args a = {"solve"};
    a.insert(a.end(), more.begin(), more.end());
    auto o = run(a);
    CAPTURE(words);
    CAPTURE(o.err);
    CHECK(o.status == 2);
    CHECK(o.err.find(words) != std::string::npos);
  }
  CHECK(f.files() == files);
  auto help = run({"solve", "--help"});
  CHECK(help.status == 0);
  for (auto word : {"Example:", "one_walk", "fundamental", "--points"})
    CHECK(help.out.find(word) != std::string::npos);
}

TEST_CASE("cli solve: faults of files are one message with their place") {
  folder f;
  const auto scene = ball_scene(f), points = some_points(f);
  const auto solve = [&](const std::string& s, const std::string& p) {
    return args{"solve", s, "--points", p, "-o", f / "u.csv"};
  };
  const std::vector<std::pair<std::string, std::vector<std::string>>> tables = {
      {"", {"bad.csv", "is empty"}},
      {"x,y,z\n", {"bad.csv", "has no points"}},
      {"x,y\n1,2\n", {"line 1", "without a column z"}},
      {"1,2,3\n", {"line 1", "must name the columns"}},
      {"x,y,z,x\n", {"line 1", "column x twice"}},
      {"x,y,z\n0,0,0\n1,2\n", {"line 3", "has 2 columns, but the first line names 3"}},
      {"x,y,z\n0,0,0,0\n", {"line 2", "has 4 columns"}},
      {"x,y,z\n\n0,zero,0\n", {"line 3", "y is 'zero'; it must be a number"}},
      {"x,y,z\n0,,0\n", {"line 2", "has no y"}},
      {"x,y,z\n0,1e999,0\n", {"line 2", "y is '1e999'"}},
      {"x,y,z\n0,1 2,0\n", {"line 2", "y is '1 2'"}}};
  for (const auto& [text, words] : tables) {
    CAPTURE(text);
    check_fault(f, solve(scene, f.write("bad.csv", text)), words);
  }
  check_fault(f, solve(scene, f / "absent.csv"), {"absent.csv", "no such file"});
  check_fault(f, solve(f / "absent.json", points), {"absent.json", "no such file"});
  check_fault(f, {"solve", scene, "--points", points, "-o", f / "no/u.csv"}, {"does not exist"});
  check_fault(f, {"solve", scene, "--section", "off", "-o", f / "u.csv"},
              {"ball.json: sections[3]: ", "misses the domain"});
  const auto with = [&](const std::string& problem) {
    return f.write("bad.json", R"({"solids": [{"name": "s", "sdf": {"sphere": {"radius": 1}}},
      {"name": "nothing", "sdf": {"intersection": [{"sphere": {"radius": 1}},
        {"sphere": {"center": [5, 0, 0], "radius": 1}}]}}],
      "problems": [)" + problem + "]}");
  };
  const std::vector<std::pair<std::string, std::vector<std::string>>> problems = {
      {"", {"problems: is missing or empty"}},
      {R"({"domain": "s", "boundary": "sin(20*foo)*2"})",
       {"bad.json: problems[0].boundary: at character 8 of \"sin(20*foo)*2\""}},
      {R"({"domain": "s"})", {"problems[0].boundary: is missing"}},
      {R"({"domain": "s", "boundary": "x", "equation": "screened_poisson", "screening": -1})",
       {"problems[0].screening"}},
      {R"({"domain": "s", "boundary": "x", "walks": 0})", {"problems[0].walks"}},
      {R"({"domain": "nothing", "boundary": "x"})", {"problems[0].domain", "empty"}}};
  for (const auto& [text, words] : problems) {
    CAPTURE(text);
    check_fault(f, solve(with(text), points), words);
  }
  const auto obj = f.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  check_fault(f, solve(obj, points), {"a.obj", "holds no problems"});
}

TEST_CASE("cli solve: meshes with colours, and in booleans where they stand") {
  folder f;
  // a cube of side 2 whose colours are linear in x, y, z
  std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
      "property float z\nproperty float red\nproperty float green\nproperty float blue\n"
      "element face 6\nproperty list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < 8; i++) {
    const int x = i & 1, y = i >> 1 & 1, z = i >> 2;
    ply += std::to_string(2 * x - 1) + " " + std::to_string(2 * y - 1) + " " +
           std::to_string(2 * z - 1) + " " + std::to_string(x) + " " + std::to_string(y) + " " +
           std::to_string(z) + "\n";
  }
  ply += "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n";
  f.write("cube.ply", ply);
  const auto scene = f.write("cube.json", R"({
    "shapes": [{"name": "cube", "uri": "cube.ply"}],
    "solids": [{"name": "moved", "sdf": {"union": [{"transform": {"frame": [2,0,0, 0,2,0, 0,0,2, 10,0,0],
      "of": {"mesh": "cube"}}}]}}],
    "problems": [
      {"name": "mesh", "domain": "cube", "boundary": {"vertex_colors": true},
       "exact": ["(1 + x)/2", "(1 + y)/2", "(1 + z)/2"]},
      {"name": "moved", "domain": "moved", "boundary": {"vertex_colors": true},
       "exact": ["(x - 8)/4", "(2 + y)/4", "(2 + z)/4"]}]})");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"mesh", "x,y,z\n0.25,-0.5,0\n0.9,0.9,-0.9\n"}, {"moved", "x,y,z\n11,0.5,-1.5\n8.5,0,0\n"}};
  for (const auto& [problem, rows] : cases) {
    CAPTURE(problem);
    auto o = run({"solve", scene, "--problem", problem, "--points", f.write("p.csv", rows),
                  "--walks", "2000", "-o", f / "u.csv", "--report", f / "r.json"});
    CAPTURE(o.err);
    REQUIRE(o.status == 0);
    CHECK(o.err.empty());
    auto t = read_table(f / "u.csv");
    for (std::size_t i = 0; i < 2; i++)
      for (const char* c : {"_0", "_1", "_2"})
        CHECK(std::abs(t.columns[std::string("value") + c][i] -
                       t.columns[std::string("exact") + c][i]) <
              6 * t.columns[std::string("std_error") + c][i] + 1e-3);
    auto report = nlohmann::json::parse(read_file(f / "r.json"));
    for (const auto& part : report["parts"]) {
      const bool built = part["built"].get<bool>();
      if (part["name"] == "distance tree") CHECK(built);
      if (part["name"] == "distance grid") CHECK(built == (problem == "mesh"));
      if (part["name"] == "colour tree") CHECK(built == (problem == "moved"));
    }
  }
}

TEST_CASE("cli solve: textures on the boundary, and sources from shapes") {
  folder f;
  // four pixels of (0.25, 0.5, 2): bytes / 256 * 2^(130 - 128)
  std::string pixels;
  for (int i = 0; i < 4; i++) pixels += "\x10\x20\x80\x82";
  f.write("plain.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n" + pixels);
  f.write("tetrahedron.obj",
          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nvt 1 1\n"
          "f 1/1 3/3 2/2\nf 1/1 2/2 4/4\nf 1/1 4/4 3/3\nf 2/2 3/3 4/4\n");
  f.write("wire.obj", "v 0 0 -0.5\nv 0 0.25 0\nv 0 0 0.5\nl 1 2 3\n");
  const auto scene = f.write("scene.json", R"({
    "textures": [{"name": "plain", "uri": "plain.hdr"}],
    "shapes": [{"name": "t", "uri": "tetrahedron.obj"}, {"name": "wire", "uri": "wire.obj"}],
    "solids": [{"name": "ball", "sdf": {"sphere": {"radius": 1}}},
               {"name": "cut", "sdf": {"difference": [{"mesh": "t"}, {"sphere": {"radius": 0.2}}]}}],
    "problems": [
      {"name": "mesh", "domain": "t", "boundary": {"texture": "plain"}},
      {"name": "cut", "domain": "cut", "boundary": {"texture": 0}},
      {"name": "ball", "domain": "ball", "boundary": {"texture": 0, "shape": "t"}},
      {"name": "points", "domain": "ball", "equation": "poisson", "boundary": 0,
       "curve_sources": [{"points": [[0, 0, -0.5], [0, 0.25, 0], [0, 0, 0.5]], "strength": -2}]},
      {"name": "shape", "domain": "ball", "equation": "poisson", "boundary": 0,
       "curve_sources": [{"shape": "wire", "strength": -2}]},
      {"name": "surface", "domain": "ball", "equation": "poisson", "boundary": 0,
       "mesh_sources": [{"shape": "t", "strength": -1}]}]})");
  const auto points = f.write("p.csv", "x,y,z\n0.25,0.25,0.25\n");
  for (const char* problem : {"mesh", "cut", "ball"}) {
    if (!has_render) break;
    CAPTURE(problem);
    auto o = run({"solve", scene, "--problem", problem, "--points", points, "-o", f / "u.csv"});
    CAPTURE(o.err);
    REQUIRE(o.status == 0);
    auto t = read_table(f / "u.csv");
    CHECK(t.columns["value_0"][0] == doctest::Approx(0.25));
    CHECK(t.columns["value_1"][0] == doctest::Approx(0.5));
    CHECK(t.columns["value_2"][0] == doctest::Approx(2));
  }
  std::map<std::string, double> value;
  for (const char* problem : {"points", "shape", "surface"}) {
    CAPTURE(problem);
    auto o = run({"solve", scene, "--problem", problem, "--points", points, "--walks", "500", "-o",
                  f / "u.csv"});
    CAPTURE(o.err);
    REQUIRE(o.status == 0);
    value[problem] = read_table(f / "u.csv").columns["value"][0];
    CHECK(value[problem] > 0);  // a negative source lifts u
    CHECK(value[problem] < 10);
  }
  CHECK(value["points"] == value["shape"]);
}

TEST_CASE("cli solve: info tells of problems and sections") {
  folder f;
  auto o = run({"info", ball_scene(f), "--json"});
  CAPTURE(o.err);
  REQUIRE(o.status == 0);
  auto info = nlohmann::json::parse(o.out);
  REQUIRE(info["problems"].size() == 6);
  CHECK(info["problems"][1]["equation"] == "poisson");
  CHECK(info["problems"][3]["side"] == "exterior");
  CHECK(info["problems"][2]["channels"] == 2);
  REQUIRE(info["sections"].size() == 4);
  CHECK(info["sections"][0]["problem"] == "linear");
}

TEST_CASE("cli solve: Ctrl-C saves what there is") {
  folder f;
  const auto scene = ball_scene(f);
  const auto points = f.write("p.csv", "x,y,z\n0,0,0\n0.5,0,0\n");
  pid_t pid = start({"solve", scene, "--points", points, "--time", "100", "-o", f / "u.csv"},
                    f / "out", f / "err");
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  kill(pid, SIGINT);
  CHECK(finish(pid) == 130);
  auto t = read_table(f / "u.csv");
  REQUIRE(t.rows == 2);
  CHECK(t.columns["walks"][0] + t.columns["walks"][1] > 200);
  CHECK(std::abs(t.columns["value"][0] - 1) < 0.1);
  CHECK(read_file(f / "out").find("stopped; saved what there is") != std::string::npos);
}
