// What wisp study computes of its runs, against numbers known beforehand.

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <vector>

#include "study_compare.h"
#include "study_json.h"
#include "study_measures.h"
#include "wisp/core/error.h"

namespace {

constexpr double none_known = std::numeric_limits<double>::quiet_NaN();

study_reference exact(std::vector<double> values) {
  study_reference r;
  r.kind = "exact";
  r.values.mean = std::move(values);
  r.relative_floor = 0.01;
  return r;
}

// Runs whose error is c / sqrt(seconds) with noise of `spread` in its logarithm.
study_result synthetic(double c, double spread, unsigned seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  study_result s;
  s.title = "synthetic";
  s.threads = 2;
  s.repeats = 4;
  for (int repeat = 0; repeat < 4; ++repeat) {
    for (int k = 0; k < 7; ++k) {
      study_run run;
      run.budget = std::uint64_t{1} << k;
      run.repeat = repeat;
      run.seconds = 0.01 * std::pow(2, k);
      run.errors.rmse = c / std::sqrt(run.seconds) * std::exp(spread * normal(engine));
      s.runs.push_back(run);
    }
  }
  s.time_fit = fit_time(s.runs);
  s.budget_fit = fit_budget(s.runs);
  return s;
}

}  // namespace

TEST_CASE("study: quantiles of Student's t") {
  // two-sided 95 %, from tables
  CHECK(student_t95(1) == doctest::Approx(12.7062).epsilon(1e-5));
  CHECK(student_t95(2) == doctest::Approx(4.30265).epsilon(1e-5));
  CHECK(student_t95(3) == doctest::Approx(3.18245).epsilon(1e-5));
  CHECK(student_t95(5) == doctest::Approx(2.57058).epsilon(1e-5));
  CHECK(student_t95(10) == doctest::Approx(2.22814).epsilon(1e-5));
  CHECK(student_t95(30) == doctest::Approx(2.04227).epsilon(1e-5));
  CHECK(student_t95(1000) == doctest::Approx(1.96234).epsilon(1e-5));
}

TEST_CASE("study: errors by hand") {
  const auto reference = exact({1, 2, none_known, 4, 0});
  const study_errors e =
      measure_errors({{1.1, 2, 7, none_known, 0.3}, {0.05, 0.1, 1, 1, 0.2}}, reference);
  CHECK(e.count == 3);
  CHECK(e.missing == 1);
  CHECK(e.mse == doctest::Approx((0.01 + 0.09) / 3));
  CHECK(e.rmse == doctest::Approx(std::sqrt(0.1 / 3)));
  CHECK(e.relmse == doctest::Approx((0.01 / 1.01 + 0 + 0.09 / 0.01) / 3));
  CHECK(e.maximum == doctest::Approx(0.3));
  CHECK(e.estimated == doctest::Approx(std::sqrt((0.0025 + 0.01 + 0.04) / 3)));
  // 0.1 is two errors away, 0 none, 0.3 one and a half
  CHECK(e.coverage == doctest::Approx(2.0 / 3));
  CHECK_THROWS_AS(measure_errors({{1, 2}, {}}, reference), std::invalid_argument);
}

TEST_CASE("study: values without noise do not count as covered and without errors nothing does") {
  const auto reference = exact({1, 2, 3});
  const auto e = measure_errors({{1, 2.1, 3}, {0, 0.1, 0}}, reference);
  CHECK(e.coverage == 1);
  const auto wrong = measure_errors({{1, 2.1, 3.5}, {0, 0.1, 0}}, reference);
  CHECK(wrong.coverage == 0.5);
  CHECK(std::isnan(measure_errors({{1, 2, 3}, {}}, reference).coverage));
  CHECK(std::isnan(measure_errors({{1, 2, 3}, {}}, reference).estimated));
  const auto none = measure_errors({{none_known, none_known, none_known}, {}}, reference);
  CHECK(none.count == 0);
  CHECK(std::isnan(none.rmse));
}

TEST_CASE("study: coverage allows for the error of the reference") {
  // Values of deviation 0.3 against a reference of deviation 0.4: differences of 0.5.
  std::mt19937 engine(5);
  std::normal_distribution<double> normal;
  study_reference reference;
  study_values values;
  constexpr int n = 40000;
  for (int i = 0; i < n; ++i) {
    reference.values.mean.push_back(1 + 0.4 * normal(engine));
    reference.values.error.push_back(0.4);
    values.mean.push_back(1 + 0.3 * normal(engine));
    values.error.push_back(0.3);
  }
  const auto e = measure_errors(values, reference);
  // Five standard errors: one false alarm in two million seeds, and the seed is fixed.
  CHECK(std::abs(e.mse - 0.25) < 5 * 0.25 * std::sqrt(2.0 / n));
  CHECK(std::abs(e.coverage - 0.95) < 5 * std::sqrt(0.95 * 0.05 / n));
}

TEST_CASE("study: lines and their intervals") {
  const double x[] = {1, 2, 3, 4, 5}, y[] = {2.1, 3.9, 6.2, 7.8, 10.1};
  // by hand: Sxx 10, Sxy 19.9, residuals 0.03, -0.16, 0.15, -0.24, 0.07... of 1.99 x + 0.05
  const study_fit fit = fit_line(x, y);
  CHECK(fit.slope == doctest::Approx(1.99));
  CHECK(fit.intercept == doctest::Approx(0.05));
  double squares = 0;
  for (int i = 0; i < 5; ++i) squares += std::pow(y[i] - 0.05 - 1.99 * x[i], 2);
  CHECK(fit.residual == doctest::Approx(std::sqrt(squares / 3)));
  CHECK(fit.half_width == doctest::Approx(3.18245 * std::sqrt(squares / 3 / 10)).epsilon(1e-4));
  CHECK(line_error(fit, 3) == doctest::Approx(fit.residual / std::sqrt(5.0)));
  CHECK(std::isnan(fit_line({}, {}).slope));
  const double same[] = {1, 1, 1};
  CHECK(std::isnan(fit_line(same, same).slope));
  CHECK(fit_line({x, 2}, {y, 2}).slope == doctest::Approx(1.8));
  CHECK(std::isnan(fit_line({x, 2}, {y, 2}).half_width));
}

TEST_CASE("study: times of one budget have no slope, nor have errors that are 0 or too large") {
  auto s = synthetic(0.02, 0.1, 1);
  for (auto& run : s.runs) run.budget = 4;
  CHECK(std::isnan(fit_time(s.runs).slope));
  CHECK(std::isnan(fit_budget(s.runs).slope));
  s = synthetic(0.02, 0, 1);
  s.runs[0].errors.rmse = 0;
  s.runs[1].errors.rmse = std::numeric_limits<double>::infinity();
  s.runs[2].seconds = std::numeric_limits<double>::infinity();
  const auto fit = fit_time(s.runs);
  CHECK(fit.count == 25);
  CHECK(fit.slope == doctest::Approx(-0.5));
}

TEST_CASE("study: intervals of slopes and of ratios hold the truth as often as they say") {
  // 2000 pairs of studies, of which one needs four times the time of the other. Bounds are
  // five standard errors of 95 %.
  constexpr int times = 2000;
  int slopes = 0, ratios = 0;
  for (unsigned i = 0; i < times; ++i) {
    const auto a = synthetic(0.02, 0.1, 2 * i + 1), b = synthetic(0.01, 0.1, 2 * i + 2);
    slopes += std::abs(a.time_fit.slope + 0.5) <= a.time_fit.half_width;
    const study_ratio r = compare_studies(a, b);
    REQUIRE_FALSE(r.outside);
    ratios += r.low <= 4 && 4 <= r.high;
  }
  const double allowed = 5 * std::sqrt(0.95 * 0.05 / times);
  CHECK(std::abs(slopes / double{times} - 0.95) < allowed);
  // b's line is not independent of where it is asked: a little more is covered
  CHECK(ratios / double{times} > 0.95 - allowed);
  CHECK(ratios / double{times} < 0.985);
}

TEST_CASE("study: studies whose errors do not meet are drawn out and flat ones not compared") {
  const auto a = synthetic(1, 0.01, 1), b = synthetic(0.001, 0.01, 2);
  const auto far = compare_studies(a, b);
  CHECK(far.outside);
  CHECK(far.time == doctest::Approx(1e6).epsilon(0.3));
  auto flat = a;
  for (auto& run : flat.runs) run.errors.rmse = 1;
  flat.time_fit = fit_time(flat.runs);
  CHECK(std::isnan(compare_studies(flat, b).time));
  // a slope that may be 0 bounds no time
  auto noisy = synthetic(0.02, 4, 3);
  REQUIRE(noisy.time_fit.slope < 0);
  REQUIRE(noisy.time_fit.half_width > -noisy.time_fit.slope);
  for (const auto& r : {compare_studies(noisy, a), compare_studies(a, noisy)}) {
    CHECK(std::isfinite(r.time));
    CHECK(std::isnan(r.low));
    CHECK(std::isnan(r.high));
  }
  const auto self = compare_studies(a, a);
  CHECK(self.time == doctest::Approx(1));
  CHECK(self.low < 1);
  CHECK(self.high > 1);
}

TEST_CASE("study: rows tell deviation and bias of repeats") {
  std::mt19937 engine(9);
  std::normal_distribution<double> normal;
  constexpr std::size_t n = 5000;
  const auto reference = exact(std::vector<double>(n, 2.0));
  study_tally tally;
  for (const double bias : {0.0, 0.1}) {
    for (int repeat = 0; repeat < 3; ++repeat) {
      study_values values;
      for (std::size_t i = 0; i < n; ++i) {
        values.mean.push_back(2 + bias + 0.05 * normal(engine));
        values.error.push_back(0.05);
      }
      study_run run;
      run.budget = bias > 0 ? 8 : 4;
      run.repeat = repeat;
      run.seconds = repeat + 1.0;
      run.errors = measure_errors(values, reference);
      tally.add(run, values);
    }
  }
  const auto rows = tally.rows(reference);
  REQUIRE(rows.size() == 2);
  for (const auto& row : rows) {
    CHECK(row.repeats == 3);
    CHECK(row.seconds == 2);
    CHECK(row.deviation == doctest::Approx(0.05).epsilon(0.02));
    CHECK(row.errors.estimated == doctest::Approx(0.05));
    CHECK(row.efficiency == doctest::Approx(1 / (2 * row.errors.mse)));
  }
  CHECK(rows[0].errors.rmse == doctest::Approx(0.05).epsilon(0.02));
  CHECK(std::isnan(rows[0].bias));
  CHECK(rows[0].errors.coverage == doctest::Approx(0.95).epsilon(0.01));
  CHECK(rows[1].bias == doctest::Approx(0.1).epsilon(0.02));
  CHECK(rows[1].errors.coverage < 0.7);
}

TEST_CASE("study: few values and repeats rarely show a bias that is not there") {
  // Values of very different noise, as near to a boundary and far from it.
  std::mt19937 engine(11);
  std::normal_distribution<double> normal;
  constexpr int times = 2000;
  for (const int size : {1, 2, 5, 40}) {
    for (const int repeats : {2, 3}) {
      int found = 0;
      for (int i = 0; i < times; ++i) {
        const auto reference = exact(std::vector<double>(static_cast<std::size_t>(size), 1.0));
        std::vector<double> noise;
        for (int k = 0; k < size; ++k) noise.push_back(std::exp(1.5 * normal(engine)));
        study_tally tally;
        for (int repeat = 0; repeat < repeats; ++repeat) {
          study_values values;
          for (const double s : noise) values.mean.push_back(1 + s * normal(engine));
          study_run run;
          run.budget = 4;
          run.errors = measure_errors(values, reference);
          tally.add(run, values);
        }
        found += std::isfinite(tally.rows(reference)[0].bias);
      }
      CAPTURE(size);
      CAPTURE(repeats);
      CHECK(found <= times / 20);  // 1 to 4 % are
    }
  }
}

TEST_CASE("study: rows of runs without values tell nothing") {
  const auto reference = exact({1, 2});
  study_tally tally;
  study_run run;
  run.budget = 4;
  run.seconds = 1;
  const study_values none = {{none_known, none_known}, {}};
  run.errors = measure_errors(none, reference);
  tally.add(run, none);
  const auto rows = tally.rows(reference);
  REQUIRE(rows.size() == 1);
  CHECK(std::isnan(rows[0].errors.rmse));
  CHECK(std::isnan(rows[0].errors.maximum));
  CHECK(std::isnan(rows[0].efficiency));
  CHECK(rows[0].errors.missing == 2);
}

TEST_CASE("study: json comes back as it was and files that are none are refused") {
  auto s = synthetic(0.02, 0.1, 3);
  s.version = "0.1.0";
  s.images.push_back({"peer.exr", 2.5, measure_errors({{1}, {}}, exact({1.5}))});
  study_row row;
  row.budget = 4;
  row.repeats = 2;
  s.rows.push_back(row);
  const auto folder = std::filesystem::temp_directory_path() / "wisp-test-study-json";
  std::filesystem::create_directories(folder);
  const auto file = folder / "study.json";
  std::ofstream(file) << study_json(s);
  const auto back = load_study(file);
  CHECK(study_json(back) == study_json(s));
  CHECK(back.runs.size() == s.runs.size());
  CHECK(back.images[0].errors.rmse == doctest::Approx(0.5));
  CHECK(compare_studies(back, s).time == doctest::Approx(1));
  for (const char* text : {"", "{", "[]", "{\"wisp\": 3}", "null", "{\"wisp\": \"0.1.0\"}"}) {
    std::ofstream(file) << text;
    CHECK_THROWS_AS(load_study(file), wisp::file_error);
  }
  // edited by hand: told with its place
  const auto edit = [&](const char* at, const nlohmann::ordered_json& value) {
    auto edited = study_json(s);
    edited[nlohmann::ordered_json::json_pointer(at)] = value;
    std::ofstream(file) << edited;
    try {
      load_study(file);
    } catch (const wisp::file_error& error) {
      return error.place;
    }
    return std::string("read");
  };
  CHECK(edit("/runs/3/seconds", -1) == "runs[3].seconds");
  CHECK(edit("/runs/3/seconds", "fast") == "runs[3].seconds");
  CHECK(edit("/runs/3/seconds", nullptr) == "read");
  CHECK(edit("/runs/0/rmse", true) == "runs[0].rmse");
  CHECK(edit("/runs/0/budget", 4.5) == "runs[0].budget");
  CHECK(edit("/runs/0/budget", 0) == "runs[0].budget");
  CHECK(edit("/runs/0/budget", -4) == "runs[0].budget");
  CHECK(edit("/runs", nlohmann::ordered_json::object()) == "runs");
  CHECK(edit("/runs/0", 3) == "runs[0]");
  CHECK(edit("/budgets/0/seconds", -1) == "budgets[0].seconds");
  CHECK(edit("/reference/error", "x") == "reference.error");
  CHECK(edit("/threads", -2) == "threads");
  CHECK(edit("/repeats", 1e30) == "repeats");
  CHECK(edit("/title", 3) == "title");
  CHECK(edit("/images", nullptr) == "images");
  CHECK_THROWS_AS(load_study(folder), wisp::file_error);
  CHECK_THROWS_AS(load_study(folder / "absent.json"), wisp::file_error);
  std::filesystem::remove_all(folder);
}

TEST_CASE("study: names tell studies apart") {
  study_result a, b;
  a.title = b.title = "heat";
  a.version = b.version = "0.1.0";
  b.method = "independent";
  const study_result both[] = {a, b};
  const std::string files[] = {"x/study.json", "y/study.json"};
  CHECK(name_studies(both, files) == std::vector<std::string>{"default", "independent"});
  const study_result same[] = {a, a};
  CHECK(name_studies(same, files) == std::vector<std::string>{"x", "y"});
  CHECK(find_differences(same, files).empty());
  const study_result stopped[] = {a, [&] {
                                    auto s = a;
                                    s.interrupted = true;
                                    return s;
                                  }()};
  REQUIRE(find_differences(stopped, files).size() == 1);
  CHECK(find_differences(stopped, files)[0].find("y/study.json: was stopped") == 0);
  b.machine = "another";
  const study_result differ[] = {a, b};
  CHECK(find_differences(differ, files).size() == 1);
}
