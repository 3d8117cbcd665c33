#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "wisp/core/report.h"

// Wall-clock and processor time by phase, for --report.
class phase_timer {
 public:
  void start(const std::string& phase);
  void stop();
  double seconds(const std::string& phase) const;
  nlohmann::ordered_json wall() const { return wall_; }
  nlohmann::ordered_json cpu() const { return cpu_; }

 private:
  std::string phase_;
  double wall_start_ = 0, cpu_start_ = 0;
  nlohmann::ordered_json wall_ = nlohmann::ordered_json::object();
  nlohmann::ordered_json cpu_ = nlohmann::ordered_json::object();
};

std::size_t peak_memory_bytes();
nlohmann::ordered_json parts_json(const std::vector<wisp::part_report>& parts);
// Indented; bytes of file names that are no UTF-8, which JSON cannot hold, become
// replacement characters.
std::string json_text(const nlohmann::ordered_json& json);
// Writes text beside the path, then renames; throws wisp::file_error.
void save_text(const std::filesystem::path& path, const std::string& text);
