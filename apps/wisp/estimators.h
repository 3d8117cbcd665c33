#pragma once

// Names of the ways to estimate a solution, for --estimator.

#include <string>
#include <vector>

#include "wisp/pde/problem.h"
#include "wisp/pde/section.h"

// One line for each group of names, for --help.
std::string estimator_help();

// Sets what the names say. Throws usage_error for a name that is none, and for two of one
// group. Gives back a sentence for each name that has no effect on this problem.
std::vector<std::string> choose_estimators(const std::vector<std::string>& names,
                                           const wisp::pde_problem& problem, bool is_section,
                                           wisp::section_options& options);
