#pragma once

// Points to solve at, and solutions, as tables of comma-separated values.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "wisp/core/math.h"
#include "wisp/pde/problem.h"
#include "wisp/pde/solve.h"

// Numbers of a table, row by row: names.size() in each; NaN in columns that it has not.
struct number_table {
  std::size_t rows = 0;
  std::vector<double> numbers = {};
  std::vector<bool> known = {};  // which columns it has
};
// Reads the columns `names` of a table whose first line names its columns, in any order;
// others are passed over, as are empty lines and those that begin with #. The first
// `needed` must be there. Throws wisp::file_error with the line of what is wrong.
number_table load_table(const std::filesystem::path& path, std::span<const std::string> names,
                        std::size_t needed);

// Reads the columns x, y and z, as load_table does. Coordinates may be nan or inf.
std::vector<wisp::dvec3> load_points(const std::filesystem::path& path);

// Writes one row for each point. Columns: x,y,z,value,std_error,walks,mean_steps; with
// gradients gx,gy,gz,gx_error,gy_error,gz_error; with `exact` exact. Problems of several
// channels number theirs: value_0,value_1,std_error_0,std_error_1, gx_0 and so on. What is
// not known is nan. The file appears whole or not at all. Throws wisp::file_error.
void save_points(const std::filesystem::path& path, std::span<const wisp::dvec3> points,
                 const wisp::solution& solution, int channels, const wisp::space_field& exact);
