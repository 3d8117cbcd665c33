#include "stress_geometry.h"

std::vector<stress_row> stress_geometry(const stress_options& options) {
  geometry_rows table{options};
  stress_geometry_closest(table);
  stress_geometry_winding(table);
  stress_geometry_solids(table);
  stress_geometry_surfaces(table);
  return table.rows;
}
