// wisp study as a user meets it.

#include <doctest/doctest.h>
#include <signal.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "run_command.h"

using nlohmann::json;

namespace {

std::string ball_scene(const folder& f) {
  return f.write("ball.json", R"json({
    "solids": [{"name": "ball", "sdf": {"sphere": {"radius": 1}}}],
    "problems": [
      {"name": "plain", "domain": "ball", "boundary": "x*y + z"},
      {"name": "known", "domain": "ball", "boundary": "x*y + z", "exact": "x*y + z"},
      {"name": "two", "domain": "ball", "boundary": ["x*x - y*y", "y*z"],
       "exact": ["x*x - y*y", "y*z"]},
      {"name": "shell", "domain": "ball", "boundary": "exp(3*x)*cos(3*y)", "epsilon": 0.4,
       "exact": "exp(3*x)*cos(3*y)"}],
    "sections": [{"name": "cut", "problem": "known", "resolution": 24},
                 {"name": "coarse", "problem": "shell", "resolution": 24}]})json");
}

std::string some_points(const folder& f) {
  std::string text = "x,y,z\n";
  for (int i = 0; i < 60; ++i) {
    const double t = 0.1 * i;
    text += std::to_string(0.7 * std::sin(t)) + "," + std::to_string(0.6 * std::cos(1.7 * t)) +
            "," + std::to_string(0.2 * std::sin(2.3 * t)) + "\n";
  }
  return f.write("points.csv", text);
}

json load(const std::string& path) { return json::parse(read_file(path)); }

std::size_t lines_of(const std::string& path) {
  const auto text = read_file(path);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

std::vector<std::string> study(const folder& f, const std::string& scene, const std::string& to,
                               std::vector<std::string> more) {
  std::vector<std::string> args = {"study", scene, "-o", f / to, "--threads", "2"};
  args.insert(args.end(), more.begin(), more.end());
  return args;
}

bool has_gnuplot() { return std::system("gnuplot --version > /dev/null 2>&1") == 0; }

}  // namespace

TEST_CASE("cli: a study of a PDE against its solution") {
  folder f;
  const auto o = run(study(f, ball_scene(f), "out",
                           {"--problem", "known", "--points", some_points(f), "--budgets",
                            "64..1024", "--repeats", "4", "--no-plots", "--estimator", "random"}));
  CAPTURE(o.err);
  REQUIRE(o.status == 0);
  CHECK(o.err.empty());
  CHECK(o.out.find("Slope of log error") != std::string::npos);
  const json s = load(f / "out/study.json");
  CHECK(s["kind"] == "pde");
  CHECK(s["unit"] == "walks");
  CHECK(s["reference"]["kind"] == "exact");
  CHECK(s["reference"]["source"] == "x*y + z");
  CHECK(s["budgets"].size() == 5);
  CHECK(s["runs"].size() == 20);
  // The slope is -1/2 but for the noise of some 20 * 60 estimates; the seed is fixed, and
  // the bound some six standard errors.
  CHECK(std::abs(s["budget_fit"]["slope"].get<double>() + 0.5) < 0.06);
  CHECK(s["budget_fit"]["half_width_95"].get<double>() < 0.1);
  CHECK(s["slope"] == s["time_fit"]["slope"]);
  std::vector<std::uint64_t> seeds;
  for (const auto& r : s["runs"]) seeds.push_back(r["seed"]);
  std::sort(seeds.begin(), seeds.end());
  CHECK(std::adjacent_find(seeds.begin(), seeds.end()) == seeds.end());
  for (const auto& row : s["budgets"]) {
    const double rmse = row["rmse"], estimated = row["estimated"], deviation = row["deviation"];
    CHECK(estimated == doctest::Approx(rmse).epsilon(0.25));
    CHECK(estimated == doctest::Approx(deviation).epsilon(0.25));
    // 240 intervals: five standard errors
    CHECK(std::abs(row["coverage"].get<double>() - 0.95) < 5 * std::sqrt(0.95 * 0.05 / 240));
    CHECK(row["efficiency"].get<double>() ==
          doctest::Approx(1 / (row["mse"].get<double>() * row["seconds"].get<double>())));
    CHECK(row["seconds"].get<double>() > 0);
    CHECK(row["values"] == 60);
    CHECK(row["missing"] == 0);
  }
  CHECK(lines_of(f / "out/study.csv") == 6);
  CHECK(lines_of(f / "out/runs.csv") == 21);
  CHECK(read_file(f / "out/study.csv").find("budget,seconds,rmse,relmse,efficiency,") == 0);
  CHECK_FALSE(fs::exists(f / "out/study.svg"));
  CHECK_FALSE(fs::exists(f / "out/reference.csv"));
  CHECK(fs::exists(f / "out/index.html"));
}

TEST_CASE("cli: studies of gradients and of several channels and a bias that is seen") {
  folder f;
  const auto scene = ball_scene(f), points = some_points(f);
  auto o = run(study(
      f, scene, "g",
      {"--problem", "known", "--points", points, "--budgets", "512", "--gradient", "--no-plots"}));
  CAPTURE(o.err);
  REQUIRE(o.status == 0);
  json row = load(f / "g/study.json")["budgets"][0];
  CHECK(row["values"] == 180);
  CHECK(row["rmse"].get<double>() < 0.2);
  CHECK(row["rmse"].get<double>() == doctest::Approx(row["estimated"].get<double>()).epsilon(0.25));
  o = run(study(f, scene, "c",
                {"--problem", "two", "--points", points, "--budgets", "512", "--no-plots"}));
  REQUIRE(o.status == 0);
  row = load(f / "c/study.json")["budgets"][0];
  CHECK(row["values"] == 120);
  CHECK(row["bias"].is_null());
  // A shell of 0.4 is no longer the boundary.
  o = run(study(f, scene, "b", {"--section", "coarse", "--budgets", "2048", "--no-plots"}));
  REQUIRE(o.status == 0);
  row = load(f / "b/study.json")["budgets"][0];
  REQUIRE(row["bias"].is_number());
  CHECK(row["bias"].get<double>() > 2 * row["deviation"].get<double>());
  CHECK(row["coverage"].get<double>() < 0.5);
  CHECK(o.out.find("a bias") != std::string::npos);
}

TEST_CASE("cli: a study without a solution makes its reference and takes it back") {
  folder f;
  const auto scene = ball_scene(f), points = some_points(f);
  const auto args = [&](const std::string& to, std::vector<std::string> more) {
    std::vector<std::string> all = {"--problem", "plain", "--points",  points,
                                    "--budgets", "16,64", "--no-plots"};
    all.insert(all.end(), more.begin(), more.end());
    return study(f, scene, to, all);
  };
  auto o = run(args("a", {}));
  CAPTURE(o.err);
  REQUIRE(o.status == 0);
  const json a = load(f / "a/study.json");
  CHECK(a["reference"]["kind"] == "run");
  CHECK(a["reference"]["source"] == "1024 walks, seed 0");
  CHECK(a["reference"]["error"].get<double>() > 0);
  CHECK(lines_of(f / "a/reference.csv") == 61);
  // the same runs against the file are off by the same
  o = run(args("b", {"--reference", f / "a/reference.csv"}));
  REQUIRE(o.status == 0);
  const json b = load(f / "b/study.json");
  CHECK(b["reference"]["kind"] == "file");
  for (std::size_t i = 0; i < a["runs"].size(); ++i)
    CHECK(b["runs"][i]["rmse"] == a["runs"][i]["rmse"]);
  // what wisp solve writes is a reference, too; and an image at a known time
  o = run({"solve", scene, "--problem", "plain", "--points", points, "--walks", "4096", "-o",
           f / "solved.csv", "--quiet"});
  REQUIRE(o.status == 0);
  o = run(args("c", {"--reference", f / "solved.csv", "--image", f / "a/reference.csv", "--seconds",
                     "2.5"}));
  CAPTURE(o.err);
  REQUIRE(o.status == 0);
  const json c = load(f / "c/study.json");
  REQUIRE(c["images"].size() == 1);
  CHECK(c["images"][0]["seconds"] == 2.5);
  CHECK(c["images"][0]["rmse"].get<double>() < c["runs"][0]["rmse"].get<double>());
  // other seeds agree
  o = run(args("d", {"--seed", "1000"}));
  REQUIRE(o.status == 0);
  const json d = load(f / "d/study.json");
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(d["budgets"][i]["rmse"] != a["budgets"][i]["rmse"]);
    CHECK(d["budgets"][i]["rmse"].get<double>() ==
          doctest::Approx(a["budgets"][i]["rmse"].get<double>()).epsilon(0.3));
  }
}

TEST_CASE("cli: a study without any error has its page and no plot, even of an earlier one") {
  folder f;
  const auto scene = f.write("none.json", R"json({
    "solids": [{"name": "ball", "sdf": {"sphere": {"radius": 1}}}],
    "problems": [
      {"name": "none", "domain": "ball", "boundary": "0"},
      {"name": "huge", "domain": "ball", "boundary": "1e200*x", "exact": "1e200*x"}]})json");
  const auto points = some_points(f);
  const std::vector<std::string> plots =
      has_gnuplot() ? std::vector<std::string>{} : std::vector<std::string>{"--no-plots"};
  for (const std::string problem : {"none", "huge"}) {
    f.write("study.svg", "an earlier one");
    std::vector<std::string> more = {"--problem", problem, "--points", points, "--budgets", "4,8"};
    more.insert(more.end(), plots.begin(), plots.end());
    const auto o = run(study(f, scene, ".", more));
    CAPTURE(o.err);
    REQUIRE(o.status == 0);
    CHECK(o.out.find("nothing to draw") != std::string::npos);
    CHECK_FALSE(fs::exists(f / "study.svg"));
    CHECK(read_file(f / "index.html").find("nothing to draw") != std::string::npos);
    CHECK(read_file(f / "index.html").find("an earlier one") == std::string::npos);
    CHECK(read_file(f / "study.json").find("nan") == std::string::npos);
    CHECK(load(f / "study.json")["slope"].is_null());
  }
}

TEST_CASE("cli: a study tells of values that do not count and of walks that were cut short") {
  folder f;
  const auto scene = ball_scene(f);
  const auto points = f.write("mixed.csv", "x,y,z\n0,0,0\n5,0,0\nnan,0,0\n0.5,0,0.1\n");
  const auto o = run(study(f, scene, "out",
                           {"--problem", "known", "--points", points, "--budgets", "16",
                            "--max-steps", "1", "--no-plots"}));
  CAPTURE(o.err);
  REQUIRE(o.status == 0);
  const json s = load(f / "out/study.json");
  CHECK(s["title"] == "known, mixed.csv");
  CHECK(s["size"] == "4 points");
  CHECK(s["budgets"][0]["values"] == 2);
  REQUIRE(s["warnings"].size() == 2);
  CHECK(s["warnings"][0] == "the reference has no number for 2 of 4 values, which do not count");
  CHECK(s["warnings"][1].get<std::string>().find("--max-steps") != std::string::npos);
  CHECK(s["slope"].is_null());  // of one budget
}

TEST_CASE("cli: studies side by side") {
  folder f;
  const auto scene = ball_scene(f);
  const std::vector<std::string> often = {"--section", "cut",        "--budgets",
                                          "4..64",     "--no-plots", "--quiet"};
  auto more = often;
  REQUIRE(run(study(f, scene, "a", more)).status == 0);
  more.insert(more.end(), {"--estimator", "independent"});
  REQUIRE(run(study(f, scene, "b", more)).status == 0);
  auto o = run(
      {"study", "--compare", f / "a/study.json", f / "b/study.json", "-o", f / "c", "--no-plots"});
  CAPTURE(o.err);
  REQUIRE(o.status == 0);
  const json c = load(f / "c/compare.json");
  REQUIRE(c["studies"].size() == 2);
  CHECK(c["studies"][0]["name"] == "default");
  CHECK(c["studies"][1]["name"] == "independent");
  CHECK(c["studies"][0]["time_ratio"] == 1.0);
  CHECK(c["differences"].empty());
  CHECK(fs::exists(f / "c/index.html"));
  // plots of an earlier comparison are not of this one
  f.write("c/compare.svg", "<svg>an earlier one</svg>");
  REQUIRE(run({"study", "--compare", f / "b/study.json", f / "a/study.json", "-o", f / "c",
               "--no-plots"})
              .status == 0);
  CHECK(read_file(f / "c/index.html").find("an earlier one") == std::string::npos);
  CHECK_FALSE(fs::exists(f / "c/compare.svg"));
  // what is of a study, and not of a comparison
  for (const auto& wrong : std::vector<std::vector<std::string>>{
           {"--budgets", "4"}, {"--report", f / "r.json"}, {"--seed", "3"}, {"--reference", "x"}}) {
    std::vector<std::string> args = {"study", "--compare", f / "a/study.json", f / "b/study.json",
                                     "-o",    f / "d"};
    args.insert(args.end(), wrong.begin(), wrong.end());
    o = run(args);
    CAPTURE(o.err);
    CHECK(o.status == 2);
    CHECK(o.err.find(wrong[0]) != std::string::npos);
    CHECK_FALSE(fs::exists(f / "d"));
  }
  const auto page = read_file(f / "a/index.html");
  CHECK(run({"study", "--compare", f / "a/study.json", f / "b/study.json", "-o", f / "a"}).status ==
        2);
  CHECK(read_file(f / "a/index.html") == page);
  if (!has_gnuplot()) {
    MESSAGE("gnuplot is not installed: its plots were not tried");
    return;
  }
  o = run({"study", "--compare", f / "a/study.json", f / "b/study.json", "-o", f / "c"});
  REQUIRE(o.status == 0);
  CHECK(read_file(f / "c/compare.svg").find("independent") != std::string::npos);
  CHECK(read_file(f / "c/compare.png").find("PNG") == 1);
}

TEST_CASE("cli: the page of a study needs no other file") {
  if (!has_gnuplot()) {
    MESSAGE("gnuplot is not installed: its plots were not tried");
    return;
  }
  folder f;
  // a name that means something to HTML and to gnuplot
  const auto scene = f.write("it's <b>&_{x}.json", read_file(ball_scene(f)));
  const auto o = run(study(f, scene, "out", {"--section", "cut", "--budgets", "4,8"}));
  CAPTURE(o.err);
  REQUIRE(o.status == 0);
  const auto page = read_file(f / "out/index.html");
  CHECK(page.find("<svg") != std::string::npos);
  CHECK(page.find("data:image/png;base64,iVBOR") != std::string::npos);
  CHECK(page.find("it's &lt;b&gt;&amp;_{x}.json") != std::string::npos);
  CHECK(page.find("<b>") == std::string::npos);
  CHECK(page.find("src=\"http") == std::string::npos);
  CHECK(page.find("href=\"http") == std::string::npos);
  CHECK(page.find("wisp study") != std::string::npos);
  CHECK(page.find("&quot;boundary&quot;") != std::string::npos);
  for (const char* file : {"study.csv", "runs.csv", "study.json", "study.svg", "study.png"})
    CHECK(fs::file_size(f / ("out/" + std::string(file))) > 0);
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(f / "out")) ++files;
  CHECK(files == 6);
}

TEST_CASE("cli: studies refuse what they cannot do and leave nothing") {
  folder f;
  const auto scene = ball_scene(f), points = some_points(f);
  for (const auto& more : std::vector<std::vector<std::string>>{
           {"--section", "cut", "--budgets", "0"},
           {"--section", "cut", "--budgets", "1,,2"},
           {"--section", "cut", "--budgets", "8..4"},
           {"--section", "cut", "--budgets", "many"},
           {"--section", "cut", "--budgets", "-4"},
           {"--section", "cut", "--repeats", "0"},
           {"--section", "cut", "--resolution", "20"},
           {"--section", "none"},
           {"--section", "cut", "--points", points},
           {"--section", "cut", "--estimator", "guess"},
           {"--section", "cut", "--image", points},
           {"--section", "cut", "--image", points, "--seconds", "0"},
           {"--section", "cut", "--compare", points, points},
           {"--section", "cut", "--time", "nan"}}) {
    const auto o = run(study(f, scene, "out", more));
    CAPTURE(more.back());
    CAPTURE(o.err);
    CHECK(o.status == 2);
    CHECK_FALSE(o.err.empty());
    CHECK_FALSE(fs::exists(f / "out"));
  }
  CHECK(run({"study", "-o", f / "out"}).status == 2);
  CHECK(run({"study", scene, "--section", "cut", "-o", ""}).status == 2);
  CHECK(run({"study", "--compare", points, "-o", f / "out"}).status == 2);
  const auto fault = [&](const std::vector<std::string>& args, const std::string& word) {
    const auto o = run(args);
    CAPTURE(o.err);
    CHECK(o.status == 1);
    CHECK(o.err.find(word) != std::string::npos);
    CHECK_FALSE(fs::exists(f / "out"));
  };
  fault(study(f, f / "absent.json", "out", {"--no-plots"}), "absent.json");
  fault(study(f, f.write("bad.json", "{"), "out", {"--no-plots"}), "bad.json");
  fault(study(f, scene, "ball.json", {"--section", "cut", "--no-plots"}), "is a file");
  fault(study(f, scene, "out", {"--section", "cut", "--no-plots", "--reference", points}),
        "points.csv");
  fault(study(f, scene, "out", {"--section", "cut", "--no-plots", "--reference", scene}), ".csv");
  fault(study(f, scene, "out",
              {"--section", "cut", "--no-plots", "--report", f / "no/such/report.json"}),
        "no/such");
  const auto outside = f.write("outside.csv", "x,y,z\n5,0,0\n");
  fault(study(f, scene, "out",
              {"--problem", "known", "--points", outside, "--no-plots", "--budgets", "4"}),
        "domain");
  fault(study(f, scene, "out",
              {"--problem", "plain", "--points", outside, "--no-plots", "--budgets", "4"}),
        "domain");
  fault({"study", "--compare", scene, scene, "-o", f / "out", "--no-plots"}, "study.json");
  // before the reference is made, and with folders above that are new
  fault(study(f, scene, "out/of/three",
              {"--problem", "plain", "--points", points, "--no-plots", "--image", f / "absent.csv",
               "--seconds", "1"}),
        "absent.csv");
  std::string unknown = "x,y,z,value,std_error\n", negative = unknown;
  std::istringstream lines(read_file(points));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    unknown += line + ",nan,0\n";
    negative += line + ",1,-1\n";
  }
  const auto nothing = f.write("nothing.csv", unknown), below = f.write("below.csv", negative);
  for (const auto& more :
       std::vector<std::vector<std::string>>{{"--reference"}, {"--seconds", "1", "--image"}}) {
    auto args = study(f, scene, "out", {"--problem", "plain", "--points", points, "--no-plots"});
    args.insert(args.end(), more.begin(), more.end());
    for (const auto& [file, word] :
         {std::pair{nothing, "nothing.csv: has no value"}, std::pair{below, "below.csv: has a"}}) {
      args.push_back(file);
      fault(args, word);
      args.pop_back();
    }
  }
}

TEST_CASE("cli: a study does not write over what it is made of") {
  folder f;
  const auto text = read_file(ball_scene(f));
  fs::create_directory(f / "out");
  const auto scene = f.write("out/study.json", text);
  const auto points = some_points(f);
  const std::vector<std::string> quick = {"--problem", "known",      "--budgets",
                                          "4",         "--no-plots", "--quiet"};
  const auto args = [&](const std::string& of, std::vector<std::string> more) {
    more.insert(more.end(), quick.begin(), quick.end());
    return study(f, of, "out", more);
  };
  auto o = run(args(scene, {"--points", points}));
  CAPTURE(o.err);
  CHECK(o.status == 2);
  CHECK(o.err.find("would be overwritten") != std::string::npos);
  CHECK(read_file(scene) == text);
  fs::remove(scene);
  const auto elsewhere = ball_scene(f);
  const auto table = read_file(points);
  const auto runs = f.write("out/runs.csv", table);
  CHECK(run(args(elsewhere, {"--points", runs})).status == 2);
  CHECK(run(args(elsewhere, {"--points", points, "--reference", runs})).status == 2);
  CHECK(run(args(elsewhere, {"--points", points, "--image", runs, "--seconds", "1"})).status == 2);
  CHECK(read_file(runs) == table);
  CHECK(run(args(elsewhere, {"--points", points, "--report", f / "out/study.csv"})).status == 2);
  // a report may be in the folder, also where that is still to be made
  fs::remove_all(f / "out");
  o = run(args(elsewhere, {"--points", points, "--report", f / "out/report.json"}));
  CAPTURE(o.err);
  CHECK(o.status == 0);
  CHECK(load(f / "out/report.json")["interrupted"] == false);
}

TEST_CASE("cli: without gnuplot a study says what to install") {
  folder f;
  const auto scene = ball_scene(f);
  const std::string path = std::getenv("PATH") ? std::getenv("PATH") : "";
  setenv("PATH", f.path.c_str(), 1);
  const auto o = run(study(f, scene, "out", {"--section", "cut", "--budgets", "4"}));
  setenv("PATH", path.c_str(), 1);
  CAPTURE(o.err);
  CHECK(o.status == 1);
  CHECK(o.err.find("gnuplot-nox") != std::string::npos);
  CHECK(o.err.find("--no-plots") != std::string::npos);
  CHECK_FALSE(fs::exists(f / "out"));
}

TEST_CASE("cli: where gnuplot fails a study keeps its numbers and a page of them") {
  folder f;
  const auto scene = ball_scene(f);
  const auto program = f.write("gnuplot", "#!/bin/sh\n[ \"$1\" = --version ] || exit 1\n");
  fs::permissions(program, fs::perms::owner_all);
  fs::create_directory(f / "out");
  f.write("out/study.svg", "<svg>an earlier one</svg>");
  f.write("out/index.html", "an earlier one");
  const std::string path = std::getenv("PATH") ? std::getenv("PATH") : "";
  setenv("PATH", (f.path.string() + ":" + path).c_str(), 1);
  const auto o = run(study(f, scene, "out", {"--section", "cut", "--budgets", "4"}));
  setenv("PATH", path.c_str(), 1);
  CAPTURE(o.err);
  CHECK(o.status == 1);
  CHECK(o.err.find("gnuplot could not draw") != std::string::npos);
  CHECK(lines_of(f / "out/study.csv") == 2);
  CHECK_FALSE(fs::exists(f / "out/study.svg"));
  const auto page = read_file(f / "out/index.html");
  CHECK(page.find("an earlier one") == std::string::npos);
  CHECK(page.find("Budgets") != std::string::npos);
}

TEST_CASE("cli: budgets of time and of error and Ctrl-C end studies with what there is") {
  folder f;
  const auto scene = ball_scene(f), points = some_points(f);
  auto args = study(f, scene, "t",
                    {"--problem", "known", "--points", points, "--budgets", "1024..1048576",
                     "--repeats", "10000", "--time", "0.2", "--no-plots"});
  REQUIRE(run(args).status == 0);
  json s = load(f / "t/study.json");
  CHECK(s["runs"].size() < 12);
  CHECK(s["warnings"].dump().find("--time") != std::string::npos);
  args = study(f, scene, "e",
               {"--problem", "known", "--points", points, "--budgets", "16..1048576", "--repeats",
                "2", "--error", "0.02", "--no-plots"});
  REQUIRE(run(args).status == 0);
  s = load(f / "e/study.json");
  CHECK(s["runs"].back()["budget"].get<int>() < 100000);
  CHECK(s["budgets"].back()["estimated"].get<double>() < 0.02);
  CHECK(s["budgets"].back()["repeats"] == 2);

  args =
      study(f, scene, "i",
            {"--problem", "known", "--points", points, "--budgets", "64,1000000000", "--no-plots"});
  // On a busy machine the first run may take long to come to its end.
  for (int seconds = 1; seconds <= 64 && !fs::exists(f / "i/study.json"); seconds *= 2) {
    const pid_t pid = start(args, f / "out.txt", f / "err.txt");
    std::this_thread::sleep_for(std::chrono::seconds(seconds));
    kill(pid, SIGINT);
    const int status = finish(pid);
    CHECK((status == 130 || status == 1000 + SIGINT));  // before it watched for it
  }
  s = load(f / "i/study.json");
  CHECK(s["interrupted"] == true);
  CHECK(s["runs"].size() == 1);
}
