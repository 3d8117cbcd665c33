#include "study_json.h"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <thread>

#include "study_measures.h"
#include "wisp/core/error.h"

using json = nlohmann::ordered_json;

namespace {

json known(double v) { return std::isfinite(v) ? json(v) : json(); }

std::string cell(double v) { return std::isfinite(v) ? fmt::format("{:.6g}", v) : ""; }

json errors_json(const study_errors& e) {
  return {{"rmse", known(e.rmse)},
          {"mse", known(e.mse)},
          {"relmse", known(e.relmse)},
          {"maximum", known(e.maximum)},
          {"estimated", known(e.estimated)},
          {"coverage", known(e.coverage)},
          {"values", e.count},
          {"missing", e.missing}};
}

json fit_json(const study_fit& f, const char* over) {
  return {{"of", "log10 rmse"},
          {"over", over},
          {"runs", f.count},
          {"slope", known(f.slope)},
          {"half_width_95", known(f.half_width)},
          {"intercept", known(f.intercept)},
          {"mean_x", f.mean_x},
          {"sum_xx", f.sum_xx},
          {"residual", f.residual}};
}

// Reads numbers where null stands for what is not known.
double number(const json& j, const char* key) {
  const auto& v = j.at(key);
  return v.is_null() ? study_unknown : v.get<double>();
}

study_errors read_errors(const json& j) {
  study_errors e;
  e.rmse = number(j, "rmse");
  e.mse = number(j, "mse");
  e.relmse = number(j, "relmse");
  e.maximum = number(j, "maximum");
  e.estimated = number(j, "estimated");
  e.coverage = number(j, "coverage");
  e.count = j.at("values").get<std::size_t>();
  e.missing = j.at("missing").get<std::size_t>();
  return e;
}

study_result read_study(const json& j) {
  study_result s;
  s.version = j.at("wisp").get<std::string>();
  s.command = j.at("command").get<std::string>();
  s.scene = j.at("scene").get<std::string>();
  s.kind = j.at("kind").get<std::string>();
  s.title = j.at("title").get<std::string>();
  s.unit = j.at("unit").get<std::string>();
  s.size = j.at("size").get<std::string>();
  s.method = j.at("method").get<std::string>();
  s.machine = j.at("machine").get<std::string>();
  s.threads = j.at("threads").get<int>();
  s.repeats = j.at("repeats").get<int>();
  s.load_seconds = number(j, "load_seconds");
  s.build_seconds = number(j, "build_seconds");
  const auto& r = j.at("reference");
  s.reference.kind = r.at("kind").get<std::string>();
  s.reference.source = r.at("source").get<std::string>();
  s.reference.error = number(r, "error");
  s.reference.seconds = number(r, "seconds");
  for (const auto& row : j.at("budgets")) {
    study_row to;
    to.budget = row.at("budget").get<std::uint64_t>();
    to.repeats = row.at("repeats").get<int>();
    to.seconds = number(row, "seconds");
    to.cpu_seconds = number(row, "cpu_seconds");
    to.errors = read_errors(row);
    to.efficiency = number(row, "efficiency");
    to.deviation = number(row, "deviation");
    to.bias = number(row, "bias");
    s.rows.push_back(to);
  }
  for (const auto& run : j.at("runs")) {
    study_run to;
    to.budget = run.at("budget").get<std::uint64_t>();
    to.repeat = run.at("repeat").get<int>();
    to.seed = run.at("seed").get<std::uint64_t>();
    to.seconds = number(run, "seconds");
    to.cpu_seconds = number(run, "cpu_seconds");
    to.build_seconds = number(run, "build_seconds");
    to.errors = read_errors(run);
    s.runs.push_back(to);
  }
  for (const auto& image : j.at("images")) {
    s.images.push_back(
        {image.at("file").get<std::string>(), number(image, "seconds"), read_errors(image)});
  }
  s.time_fit = fit_time(s.runs);
  s.budget_fit = fit_budget(s.runs);
  return s;
}

std::string columns_of(const study_errors& e) {
  return fmt::format("{},{},{},{},{},{},{}", cell(e.rmse), cell(e.relmse), cell(e.maximum),
                     cell(e.estimated), cell(e.coverage), e.count, e.missing);
}
constexpr const char* error_columns = "rmse,relmse,maximum,estimated,coverage,values,missing";

}  // namespace

json study_json(const study_result& s) {
  json rows = json::array(), runs = json::array(), images = json::array();
  const auto join = [](json head, const study_errors& e) {
    head.update(errors_json(e));
    return head;
  };
  for (const auto& r : s.rows) {
    json row = join({{"budget", r.budget},
                     {"repeats", r.repeats},
                     {"seconds", r.seconds},
                     {"cpu_seconds", r.cpu_seconds}},
                    r.errors);
    row["efficiency"] = known(r.efficiency);
    row["deviation"] = known(r.deviation);
    row["bias"] = known(r.bias);
    rows.push_back(row);
  }
  for (const auto& r : s.runs) {
    runs.push_back(join({{"budget", r.budget},
                         {"repeat", r.repeat},
                         {"seed", r.seed},
                         {"seconds", r.seconds},
                         {"cpu_seconds", r.cpu_seconds},
                         {"build_seconds", r.build_seconds}},
                        r.errors));
  }
  for (const auto& i : s.images)
    images.push_back(join({{"file", i.file}, {"seconds", i.seconds}}, i.errors));
  return {{"wisp", s.version},
          {"command", s.command},
          {"scene", s.scene},
          {"kind", s.kind},
          {"title", s.title},
          {"size", s.size},
          {"unit", s.unit},
          {"method", s.method},
          {"machine", s.machine},
          {"threads", s.threads},
          {"repeats", s.repeats},
          {"interrupted", s.interrupted},
          {"load_seconds", s.load_seconds},
          {"build_seconds", s.build_seconds},
          {"reference",
           {{"kind", s.reference.kind},
            {"source", s.reference.source},
            {"error", s.reference.error},
            {"seconds", s.reference.seconds},
            {"relative_floor", s.reference.relative_floor}}},
          {"slope", known(s.time_fit.slope)},
          {"slope_half_width_95", known(s.time_fit.half_width)},
          {"time_fit", fit_json(s.time_fit, "log10 seconds")},
          {"budget_fit", fit_json(s.budget_fit, "log10 budget")},
          {"budgets", rows},
          {"runs", runs},
          {"images", images},
          {"warnings", s.warnings}};
}

study_result load_study(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in || std::filesystem::is_directory(path)) {
    throw wisp::file_error(path.string(), "", "cannot be read; give a study.json");
  }
  try {
    return read_study(json::parse(in));
  } catch (const json::parse_error& error) {
    throw wisp::file_error(path.string(), fmt::format("byte {}", error.byte),
                           "is no JSON; give a study.json");
  } catch (const json::exception& error) {
    std::string text = error.what();
    if (const auto end = text.find("] "); end != std::string::npos) text.erase(0, end + 2);
    throw wisp::file_error(path.string(), "",
                           "is not what wisp study writes as study.json: " + text);
  }
}

std::string rows_csv(const study_result& s) {
  std::string text = fmt::format(
      "budget,seconds,rmse,relmse,efficiency,maximum,estimated,coverage,deviation,bias,"
      "cpu_seconds,repeats,values,missing\n");
  for (const auto& r : s.rows) {
    const auto& e = r.errors;
    text += fmt::format("{},{:.6g},{},{},{},{},{},{},{},{},{:.6g},{},{},{}\n", r.budget, r.seconds,
                        cell(e.rmse), cell(e.relmse), cell(r.efficiency), cell(e.maximum),
                        cell(e.estimated), cell(e.coverage), cell(r.deviation), cell(r.bias),
                        r.cpu_seconds, r.repeats, e.count, e.missing);
  }
  return text;
}

std::string runs_csv(const study_result& s) {
  std::string text =
      fmt::format("budget,repeat,seed,seconds,cpu_seconds,build_seconds,{}\n", error_columns);
  for (const auto& r : s.runs) {
    text += fmt::format("{},{},{},{:.6g},{:.6g},{:.6g},{}\n", r.budget, r.repeat, r.seed, r.seconds,
                        r.cpu_seconds, r.build_seconds, columns_of(r.errors));
  }
  return text;
}

std::string describe_machine(int threads) {
  std::string processor = "unknown processor";
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    const auto colon = line.find(": ");
    if (colon == std::string::npos || !line.starts_with("model name")) continue;
    processor = line.substr(colon + 2);
    break;
  }
  utsname system = {};
  std::string name = "unknown system";
  if (uname(&system) == 0) {
    name = fmt::format("{} {}, {}", system.sysname, system.release, system.machine);
  }
  return fmt::format("{}, {} of {} threads, {}", processor, threads,
                     std::thread::hardware_concurrency(), name);
}
