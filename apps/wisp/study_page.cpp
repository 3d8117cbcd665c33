#include "study_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <vector>

#include "study_compare.h"
#include "study_json.h"
#include "study_measures.h"

namespace fs = std::filesystem;

namespace {

std::string html(const std::string& text) {
  std::string result;
  for (const char c : valid_utf8(text)) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

// The whole of a file; empty if it cannot be read.
std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::string base64(const std::string& bytes) {
  static constexpr char digits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string result;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) {
      const bool padding = i + k > bytes.size();
      result += padding ? '=' : digits[word >> (18 - 6 * k) & 63];
    }
  }
  return result;
}

std::string number(double v, const char* unknown = "-") {
  return std::isfinite(v) ? fmt::format("{:.3g}", v) : unknown;
}
std::string percent(double v) { return std::isfinite(v) ? fmt::format("{:.1f} %", 100 * v) : "-"; }

std::string slope_text(const study_fit& fit) {
  if (!std::isfinite(fit.slope)) return "unknown";
  return std::isfinite(fit.half_width) ? fmt::format("{:.3f} +- {:.3f}", fit.slope, fit.half_width)
                                       : fmt::format("{:.3f}", fit.slope);
}

std::string reference_text(const study_result& s) {
  const auto& r = s.reference;
  if (r.kind == "exact") return "the exact solution " + r.source;
  std::string text = r.kind == "run" ? "a run of " + r.source : r.source;
  if (r.error > 0) text += fmt::format(", itself known to {:.2g}", r.error);
  return text;
}

using table = std::vector<std::vector<std::string>>;  // the first row names the columns

table rows_table(const study_result& s) {
  table rows = {{s.unit, "seconds", "RMSE", "relMSE", "maximum", "estimated", "deviation",
                 "coverage", "efficiency"}};
  for (const auto& r : s.rows) {
    rows.push_back({std::to_string(r.budget), number(r.seconds), number(r.errors.rmse),
                    number(r.errors.relmse), number(r.errors.maximum), number(r.errors.estimated),
                    number(r.deviation), percent(r.errors.coverage), number(r.efficiency)});
  }
  return rows;
}

table images_table(const study_result& s) {
  table rows = {{"image", "seconds", "RMSE", "relMSE", "maximum"}};
  for (const auto& i : s.images) {
    rows.push_back({i.file, number(i.seconds), number(i.errors.rmse), number(i.errors.relmse),
                    number(i.errors.maximum)});
  }
  return rows;
}

table compare_table(std::span<const study_result> studies, std::span<const std::string> names) {
  table rows = {{"study", "slope over time", "at error", "time to it", "95 % interval"}};
  for (std::size_t i = 0; i < studies.size(); ++i) {
    std::vector<std::string> row = {names[i], slope_text(studies[i].time_fit)};
    if (i == 0) {
      row.insert(row.end(), {"", "1", ""});
    } else {
      const auto r = compare_studies(studies[i], studies[0]);
      row.push_back(number(r.error) + (r.outside ? " (drawn out)" : ""));
      row.push_back(number(r.time));
      row.push_back(std::isfinite(r.low) ? fmt::format("{} to {}", number(r.low), number(r.high))
                                         : "-");
    }
    rows.push_back(row);
  }
  return rows;
}

std::string text_table(const table& rows) {
  std::vector<std::size_t> widths(rows[0].size(), 0);
  for (const auto& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      line += c == 0 ? fmt::format("{:<{}}", row[c], widths[c])
                     : fmt::format("  {:>{}}", row[c], widths[c]);
    }
    text += line + "\n";
  }
  return text;
}

std::string html_table(const table& rows) {
  std::string text = "<div class=\"wide\"><table>\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    text += "<tr>";
    for (const auto& c : rows[r])
      text += fmt::format("<{0}>{1}</{0}>", r == 0 ? "th" : "td", html(c));
    text += "</tr>\n";
  }
  return text + "</table></div>\n";
}

// What the numbers mean, in words.
std::vector<std::string> findings(const study_result& s) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format(
      "Slope of log error over log time: {}; over log {}: {} (-0.5 is what independent samples "
      "give).",
      slope_text(s.time_fit), s.unit, slope_text(s.budget_fit)));
  if (std::none_of(s.runs.begin(), s.runs.end(),
                   [](const study_run& run) { return drawable(run.errors.rmse); })) {
    lines.push_back("No run has an error that is finite and above 0: there is nothing to draw.");
  }
  lines.push_back("Reference: " + reference_text(s) + ".");
  if (!s.rows.empty()) {
    const auto& last = s.rows.back();
    if (std::isfinite(last.errors.estimated) && std::isfinite(last.deviation)) {
      std::string line = fmt::format(
          "At {} {} wisp estimates an error of {}; between repeats values deviate by {}.",
          last.budget, s.unit, number(last.errors.estimated), number(last.deviation));
      if (std::isfinite(last.errors.coverage)) {
        line += fmt::format(" {} of the 95 % intervals hold the reference.",
                            percent(last.errors.coverage));
      }
      lines.push_back(line);
    }
    // A run of 16 times the budget is off by about a quarter of that.
    if (s.reference.error > 0.35 * last.errors.rmse) {
      lines.push_back(fmt::format(
          "The error of the reference is not small against that at {} {}, {}, and is part of it: a "
          "better reference would show less, and a steeper slope.",
          last.budget, s.unit, number(last.errors.rmse)));
    }
    if (std::isfinite(last.bias)) {
      lines.push_back(fmt::format(
          "At {} {} repeats share an error of {}: a bias, or that of the reference. More {} do "
          "not lessen it.",
          last.budget, s.unit, number(last.bias), s.unit));
    }
    if (last.errors.missing > 0) {
      lines.push_back(fmt::format("{} values that the reference has are missing in runs.",
                                  last.errors.missing));
    }
  }
  for (const auto& i : s.images) {
    if (i.errors.missing == 0) continue;
    lines.push_back(fmt::format("{} values that the reference has are missing in {}.",
                                i.errors.missing, i.file));
  }
  lines.push_back(fmt::format("Loading took {} s and building {} s, which is not part of the time.",
                              number(s.load_seconds), number(s.build_seconds)));
  for (const auto& w : s.warnings) lines.push_back("Warning: " + w);
  if (s.interrupted) lines.push_back("The study was stopped before its end.");
  return lines;
}

std::string page(const std::string& title, const std::string& body) {
  return "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         html(title) +
         "</title>\n<style>\n"
         "body { font: 16px/1.5 system-ui, sans-serif; max-width: 960px; margin: 2em auto; "
         "padding: 0 1em; color: #222; background: #fff }\n"
         "h1 { font-size: 1.5em } h2 { font-size: 1.15em; margin-top: 2em }\n"
         ".wide { overflow-x: auto } svg, img { max-width: 100%; height: auto }\n"
         "table { border-collapse: collapse; font-variant-numeric: tabular-nums }\n"
         "th, td { padding: 0.2em 0.8em; text-align: right; border-bottom: 1px solid #ddd }\n"
         "th:first-child, td:first-child { text-align: left }\n"
         "pre { background: #f5f5f5; padding: 0.8em; overflow-x: auto }\n"
         "</style>\n</head>\n<body>\n<h1>" +
         html(title) + "</h1>\n" + body + "</body>\n</html>\n";
}

// The plot in the page, and as a picture to save.
std::string plots(const fs::path& folder, const std::string& name) {
  std::string svg = read_file(folder / (name + ".svg"));
  const std::string png = read_file(folder / (name + ".png"));
  if (const auto start = svg.find("<svg"); start != std::string::npos) svg.erase(0, start);
  std::string text;
  if (!svg.empty()) text += "<div>\n" + svg + "</div>\n";
  if (!png.empty()) {
    text +=
        "<details><summary>The same as PNG</summary><img alt=\"error against time\" "
        "src=\"data:image/png;base64," +
        base64(png) + "\"></details>\n";
  }
  return text;
}

std::string scene_text(const std::string& file) {
  constexpr std::size_t most = 200000;
  const auto extension = fs::path(file).extension();
  if (extension != ".json" && extension != ".gltf") return "";
  const std::string text = read_file(file);
  if (text.empty() || text.size() > most) return "";
  return "<details><summary>The scene</summary><pre>" + html(text) + "</pre></details>\n";
}

std::string facts(const study_result& s) {
  return fmt::format("<p>{}, {}, {} repeats. wisp {}. {}.</p>\n<pre>{}</pre>\n", html(s.scene),
                     html(s.size), s.repeats, html(s.version), html(s.machine), html(s.command));
}

}  // namespace

std::string study_text(const study_result& s) {
  std::string text = fmt::format("{}, {}\n\n{}", s.title, s.size, text_table(rows_table(s)));
  if (!s.images.empty()) text.append("\n").append(text_table(images_table(s)));
  text += "\n";
  for (const auto& line : findings(s)) text.append(line).append("\n");
  return text;
}

std::string compare_text(std::span<const study_result> studies, std::span<const std::string> names,
                         std::span<const std::string> differences) {
  std::string text = text_table(compare_table(studies, names));
  if (!differences.empty()) text += "\nNot alike in all:\n";
  for (const auto& d : differences) text += d + "\n";
  return text;
}

std::string study_page(const study_result& s, const fs::path& folder) {
  std::string body = plots(folder, "study") + "<ul>\n";
  for (const auto& line : findings(s)) body += fmt::format("<li>{}</li>\n", html(line));
  body += "</ul>\n<h2>Budgets</h2>\n" + html_table(rows_table(s));
  body +=
      "<p>RMSE: root mean square error; that of the reference is in it. relMSE: mean of d&sup2; / "
      "(r&sup2; + s). Estimated: the root mean square of the standard errors that wisp tells. "
      "Deviation: of values between repeats. Coverage: of 95 % intervals. Efficiency: 1 / (MSE "
      "&middot; seconds). Seconds are medians.</p>\n";
  if (!s.images.empty()) body += "<h2>Images</h2>\n" + html_table(images_table(s));
  body += "<h2>How</h2>\n" + facts(s) + scene_text(s.scene);
  return page("Error against time: " + s.title, body);
}

std::string compare_page(std::span<const study_result> studies, std::span<const std::string> names,
                         std::span<const std::string> differences, const fs::path& folder,
                         const std::string& command) {
  std::string body = plots(folder, "compare") + html_table(compare_table(studies, names));
  body += fmt::format(
      "<p>Time to an error in the middle of those that both reach, over that of {}, by the lines "
      "fitted to all runs.</p>\n",
      html(names[0]));
  if (!differences.empty()) {
    body += "<h2>Not alike in all</h2>\n<ul>\n";
    for (const auto& d : differences) body += fmt::format("<li>{}</li>\n", html(d));
    body += "</ul>\n";
  }
  body += fmt::format("<pre>{}</pre>\n", html(command));
  for (std::size_t i = 0; i < studies.size(); ++i) {
    body += "<h2>" + html(names[i]) + "</h2>\n" + html_table(rows_table(studies[i])) +
            facts(studies[i]);
  }
  return page("Studies side by side", body);
}
