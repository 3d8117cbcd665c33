#include "study_json.h"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <climits>
#include <cmath>
#include <cstdint>
#include <fstream>
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

// A value of the file and its place there, as in runs[3].seconds.
class entry {
 public:
  entry(const json& value, std::string place) : value_(&value), place_(std::move(place)) {}

  entry operator[](const char* key) const {
    if (!value_->is_object()) fail("must be an object");
    const auto found = value_->find(key);
    const std::string place = place_.empty() ? key : place_ + "." + key;
    if (found == value_->end()) throw wisp::file_error("", place, "is missing; give a study.json");
    return {*found, place};
  }
  std::vector<entry> list() const {
    if (!value_->is_array()) fail("must be an array");
    std::vector<entry> items;
    for (const auto& item : *value_)
      items.emplace_back(item, fmt::format("{}[{}]", place_, items.size()));
    return items;
  }
  std::string text() const {
    if (!value_->is_string()) fail("must be a text");
    return value_->get<std::string>();
  }
  // Nothing that is measured is below 0; null stands for what is not known.
  double number() const {
    if (value_->is_null()) return study_unknown;
    if (!value_->is_number() || value_->get<double>() < 0)
      fail("must be a number of at least 0, or null");
    return value_->get<double>();
  }
  std::uint64_t whole(std::uint64_t least, std::uint64_t most = UINT64_MAX) const {
    const auto value = value_->is_number_unsigned() ? value_->get<std::uint64_t>() : 0;
    if (!value_->is_number_unsigned() || value < least || value > most)
      fail(fmt::format("must be a whole number from {} to {}", least, most));
    return value;
  }
  int count(int least) const {
    return static_cast<int>(whole(static_cast<std::uint64_t>(least), INT_MAX));
  }
  bool truth() const {
    if (!value_->is_boolean()) fail("must be true or false");
    return value_->get<bool>();
  }

 private:
  [[noreturn]] void fail(const std::string& must) const {
    std::string is = value_->dump(-1, ' ', true, json::error_handler_t::replace);
    if (is.size() > 40) is = is.substr(0, 37) + "...";
    throw wisp::file_error("", place_, fmt::format("is {}; it {}", is, must));
  }

  const json* value_;
  std::string place_;
};

study_errors read_errors(const entry& j) {
  study_errors e;
  e.rmse = j["rmse"].number();
  e.mse = j["mse"].number();
  e.relmse = j["relmse"].number();
  e.maximum = j["maximum"].number();
  e.estimated = j["estimated"].number();
  e.coverage = j["coverage"].number();
  e.count = j["values"].whole(0);
  e.missing = j["missing"].whole(0);
  return e;
}

study_result read_study(const entry& j) {
  study_result s;
  s.version = j["wisp"].text();
  s.command = j["command"].text();
  s.scene = j["scene"].text();
  s.kind = j["kind"].text();
  s.title = j["title"].text();
  s.unit = j["unit"].text();
  s.size = j["size"].text();
  s.method = j["method"].text();
  s.machine = j["machine"].text();
  s.threads = j["threads"].count(1);
  s.repeats = j["repeats"].count(1);
  s.interrupted = j["interrupted"].truth();
  s.load_seconds = j["load_seconds"].number();
  s.build_seconds = j["build_seconds"].number();
  const auto r = j["reference"];
  s.reference.kind = r["kind"].text();
  s.reference.source = r["source"].text();
  s.reference.error = r["error"].number();
  s.reference.seconds = r["seconds"].number();
  s.reference.relative_floor = r["relative_floor"].number();
  for (const auto& row : j["budgets"].list()) {
    study_row to;
    to.budget = row["budget"].whole(1);
    to.repeats = row["repeats"].count(1);
    to.seconds = row["seconds"].number();
    to.cpu_seconds = row["cpu_seconds"].number();
    to.errors = read_errors(row);
    to.efficiency = row["efficiency"].number();
    to.deviation = row["deviation"].number();
    to.bias = row["bias"].number();
    s.rows.push_back(to);
  }
  for (const auto& run : j["runs"].list()) {
    study_run to;
    to.budget = run["budget"].whole(1);
    to.repeat = run["repeat"].count(0);
    to.seed = run["seed"].whole(0);
    to.seconds = run["seconds"].number();
    to.cpu_seconds = run["cpu_seconds"].number();
    to.build_seconds = run["build_seconds"].number();
    to.errors = read_errors(run);
    s.runs.push_back(to);
  }
  for (const auto& image : j["images"].list())
    s.images.push_back({image["file"].text(), image["seconds"].number(), read_errors(image)});
  for (const auto& warning : j["warnings"].list()) s.warnings.push_back(warning.text());
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
    return read_study({json::parse(in), ""});
  } catch (const json::parse_error& error) {
    throw wisp::file_error(path.string(), fmt::format("byte {}", error.byte),
                           "is no JSON; give a study.json");
  } catch (const json::exception&) {  // 1e999
    throw wisp::file_error(path.string(), "", "has a number that is too large for a study.json");
  } catch (const wisp::file_error& error) {
    throw wisp::file_error(path.string(), error.place, error.reason);
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

std::string valid_utf8(const std::string& text) {
  return json::parse(json(text).dump(-1, ' ', false, json::error_handler_t::replace))
      .get<std::string>();
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
