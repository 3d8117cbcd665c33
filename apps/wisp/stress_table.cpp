#include "stress_table.h"

#include <fmt/format.h>

std::string stress_table(const std::vector<stress_row>& rows) {
  std::string text =
      "| case | expected | got | held to | error / bound | verdict |\n"
      "| --- | --- | --- | --- | --- | --- |\n";
  for (const auto& row : rows) {
    std::string ratio = row.bound > 0    ? fmt::format("{:.2g}", row.error / row.bound)
                        : row.error == 0 ? "0"
                                         : fmt::format("{:.3g} / 0", row.error);
    text += fmt::format("| {} | {} | {} | {} | {} | {} |\n", row.what, row.expected, row.got,
                        row.bound > 0 ? fmt::format("{:.2g}", row.bound) : "exactly", ratio,
                        passes(row) ? "ok" : "**FAILED**");
  }
  return text;
}
