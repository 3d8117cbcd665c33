#include "run_report.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>

#include "wisp/core/error.h"

namespace {

double wall_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double cpu_now() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

void phase_timer::start(const std::string& phase) {
  if (!phase_.empty()) stop();
  phase_ = phase;
  wall_start_ = wall_now();
  cpu_start_ = cpu_now();
}

void phase_timer::stop() {
  if (phase_.empty()) return;
  wall_[phase_] = wall_now() - wall_start_;
  cpu_[phase_] = cpu_now() - cpu_start_;
  phase_.clear();
}

double phase_timer::seconds(const std::string& phase) const {
  return wall_.contains(phase) ? wall_[phase].get<double>() : 0;
}

// VmHWM where there is /proc: ru_maxrss also counts the process that started this one.
std::size_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmHWM:", 0) == 0)
      return static_cast<std::size_t>(std::strtoull(line.c_str() + 6, nullptr, 10)) * 1024;
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

nlohmann::ordered_json parts_json(const std::vector<wisp::part_report>& parts) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& part : parts)
    list.push_back({{"name", part.name},
                    {"built", part.built},
                    {"why", part.why},
                    {"seconds", part.built ? part.seconds : 0},
                    {"bytes", part.built ? part.bytes : 0}});
  return list;
}

std::string json_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

void save_text(const std::filesystem::path& path, const std::string& text) {
  auto beside = path.parent_path() / fmt::format(".wisp-{}.tmp", getpid());
  {
    std::ofstream out(beside, std::ios::binary);
    out << text;
    out.close();
    if (!out) {
      std::error_code ignored;
      std::filesystem::remove(beside, ignored);
      throw wisp::file_error(path.string(), "",
                             "cannot be written; does the folder exist, is there room?");
    }
  }
  std::error_code error;
  std::filesystem::rename(beside, path, error);
  if (error) {
    std::error_code ignored;
    std::filesystem::remove(beside, ignored);
    throw wisp::file_error(path.string(), "", "cannot be written: " + error.message());
  }
}
