#pragma once

// Studies side by side.

#include <span>
#include <string>
#include <vector>

#include "study.h"

// What one study has over another, of the lines fitted to their runs, in the middle of the
// errors that both reach.
struct study_ratio {
  double error = study_unknown;                      // where they are compared
  double time = study_unknown;                       // of the time to that error
  double low = study_unknown, high = study_unknown;  // of its 95 % interval
  bool outside = false;  // no error is reached by both: the lines are drawn out
};

study_ratio compare_studies(const study_result& study, const study_result& against);

// Short names that tell studies apart: titles, methods, versions, else their files.
std::vector<std::string> name_studies(std::span<const study_result> studies,
                                      std::span<const std::string> files);

// Reasons why the studies should not be held against each other.
std::vector<std::string> find_differences(std::span<const study_result> studies,
                                          std::span<const std::string> files);
