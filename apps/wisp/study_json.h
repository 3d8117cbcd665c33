#pragma once

// Studies as files: study.json, study.csv and runs.csv.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "study.h"

nlohmann::ordered_json study_json(const study_result& study);
// Reads what study_json made. Throws wisp::file_error.
study_result load_study(const std::filesystem::path& path);

// budget,seconds,rmse,relmse,efficiency and more, a row for each budget; empty fields for
// what is not known.
std::string rows_csv(const study_result& study);
// The same of single runs.
std::string runs_csv(const study_result& study);

// The text with replacement characters for what is no UTF-8, as names of files may be.
std::string valid_utf8(const std::string& text);

// "AMD EPYC 7543, 2 threads of 2, Linux 6.1, x86_64".
std::string describe_machine(int threads);
