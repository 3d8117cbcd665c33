#include "study_plot.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "run_report.h"
#include "study_json.h"
#include "wisp/core/error.h"

extern char** environ;

namespace fs = std::filesystem;

namespace {

// The exit status of gnuplot with a script; -1 if it does not start.
int run_gnuplot(std::vector<std::string> arguments) {
  std::vector<char*> argv;
  std::string program = "gnuplot";
  argv.push_back(program.data());
  for (auto& a : arguments) argv.push_back(a.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int fd : {0, 1, 2})
    posix_spawn_file_actions_addopen(&actions, fd, "/dev/null", O_RDWR, 0);
  posix_spawnattr_t attributes;  // in a group of its own, which Ctrl-C does not reach
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, "gnuplot", &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return -1;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// A string of gnuplot: single quotes are doubled, control characters left out, and what is
// no UTF-8 is replaced, as it would make the .svg unreadable.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : valid_utf8(text)) {
    if (static_cast<unsigned char>(c) < 0x20) continue;
    result += c == '\'' ? "''" : std::string(1, c);
  }
  return result + "'";
}

// What fits below the picture: long names are cut, between characters.
std::string shortened(const std::string& text) {
  constexpr std::size_t most = 80;
  if (text.size() <= most) return text;
  std::size_t end = most - 3;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

// Places of an axis with their labels: 1, 2 and 5 of each power of ten; more where the axis
// is short, and of a long one powers alone.
std::string ticks(double low, double high) {
  const double decades = std::log10(high / low);
  const int every = decades > 3 ? std::max(1, static_cast<int>(decades / 8)) : 1;
  std::vector<double> digits = {1, 2, 5};
  if (decades > 3) digits = {1};
  if (decades < 1) digits = {1, 1.5, 2, 3, 4, 6};
  if (decades < 0.5) digits = {1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8};
  std::string list;
  for (int e = static_cast<int>(std::floor(std::log10(low))) - 1;
       e <= static_cast<int>(std::ceil(std::log10(high))); ++e) {
    for (const double digit : digits) {
      if (e % every != 0) continue;
      const double at = digit * std::pow(10, e);
      list += fmt::format("{}'{:.3g}' {:.9g}", list.empty() ? "(" : ", ", at, at);
    }
  }
  return list + ")";
}

struct curve {
  std::string block, style, title;
};

// gnuplot's axes end near the limits of double.
bool on_paper(double v) { return v > 1e-200 && v < 1e200; }

class script {
 public:
  void add(const std::string& style, const std::string& title,
           const std::vector<std::pair<double, double>>& points) {
    std::string rows;
    for (const auto& [x, y] : points) {
      if (!on_paper(x) || !on_paper(y)) continue;
      rows += fmt::format("{:.9g} {:.9g}\n", x, y);
      low_.first = std::min(low_.first, x);
      low_.second = std::min(low_.second, y);
      high_.first = std::max(high_.first, x);
      high_.second = std::max(high_.second, y);
    }
    if (rows.empty()) return;
    const auto block = fmt::format("$data{}", curves_.size());
    data_ += fmt::format("{} << EOD\n{}EOD\n", block, rows);
    curves_.push_back({block, style, title});
  }

  bool empty() const { return curves_.empty(); }

  std::string text(const std::string& title, const fs::path& svg, const fs::path& png) const {
    std::string plot;
    for (const auto& c : curves_) {
      plot +=
          fmt::format("{}{} using 1:2 {} {}", plot.empty() ? "plot " : ", \\\n  ", c.block, c.style,
                      c.title.empty() ? "notitle" : "title " + quoted(shortened(c.title)));
    }
    // a guide through the middle of the picture
    const double x = std::sqrt(low_.first * high_.first), y = std::sqrt(low_.second * high_.second);
    plot += fmt::format(
        ", \\\n  {:.9g} * (x / {:.9g})**-0.5 with lines linecolor rgb '#bbbbbb' dashtype 3 "
        "linewidth 1.5 title 'slope -1/2'\n",
        y, x);
    // room around the data
    const auto axis = [](const char* name, double low, double high) {
      const double by = std::max(1.3, std::pow(high / low, 0.06));
      return fmt::format("set {0}range [{1:.9g}:{2:.9g}]\nset {0}tics {3}\n", name, low / by,
                         high * by, ticks(low / by, high * by));
    };
    std::string result = data_;
    result += fmt::format(
        "set logscale xy\n{}{}"
        "set xlabel 'seconds of estimating' offset 0,0.4\nset ylabel 'root mean square error'\n"
        "set grid xtics ytics linewidth 0.6 linecolor rgb '#cccccc' dashtype 1\n"
        "set border linewidth 0.8 linecolor rgb '#666666'\nset tics textcolor rgb '#333333'\n"
        "set key below Left reverse noenhanced maxrows 4 height 0.7\nset title {} noenhanced\n"
        "set samples 200\n",
        axis("x", low_.first, high_.first), axis("y", low_.second, high_.second),
        quoted(shortened(title)));
    // room for the names below, each of which may need a line
    const auto names = std::count_if(curves_.begin(), curves_.end(),
                                     [](const curve& c) { return !c.title.empty(); });
    const auto height = 620 + 22 * std::max<std::ptrdiff_t>(names - 3, 0);
    result += fmt::format(
        "set terminal svg size 860,{} dynamic font 'Helvetica,15' background '#ffffff'\n"
        "set output {}\n{}set output\n"
        "set terminal pngcairo size 1290,{} font ',17' background '#ffffff'\n"
        "set output {}\nreplot\nset output\n",
        height, quoted(svg.string()), plot, height * 3 / 2, quoted(png.string()));
    return result;
  }

 private:
  std::string data_;
  std::vector<curve> curves_;
  std::pair<double, double> low_ = {1e300, 1e300}, high_ = {0, 0};
};

// Colours that people with any colour vision tell apart (Okabe and Ito 2008).
constexpr const char* colors[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                  "#e69f00", "#56b4e9", "#000000"};

script draw(std::span<const study_result> studies, std::span<const std::string> names) {
  script s;
  for (std::size_t i = 0; i < studies.size(); ++i) {
    const auto& study = studies[i];
    const std::string color = colors[i % std::size(colors)];
    std::vector<std::pair<double, double>> runs, rows, estimated;
    for (const auto& r : study.runs) runs.emplace_back(r.seconds, r.errors.rmse);
    for (const auto& r : study.rows) {
      rows.emplace_back(r.seconds, r.errors.rmse);
      estimated.emplace_back(r.seconds, r.errors.estimated);
    }
    const bool alone = studies.size() == 1;
    const auto round = i / std::size(colors);  // where there are more than colours
    s.add(fmt::format("with points pointtype {} pointsize 0.7 linecolor rgb '{}'",
                      round == 0 ? 7 : 5, color),
          alone ? "single runs" : "", runs);
    s.add(fmt::format("with lines linewidth 2.2 dashtype {} linecolor rgb '{}'", round % 5 + 1,
                      color),
          alone ? "error against the reference" : names[i], rows);
    if (alone) {
      s.add(
          "with linespoints pointtype 6 pointsize 0.6 linewidth 1.8 dashtype 2 linecolor rgb "
          "'#d55e00'",
          "error that wisp estimates itself", estimated);
    }
    int mark = 0;
    for (const auto& image : study.images) {
      s.add(fmt::format("with points pointtype {} pointsize 1.8 linewidth 2 linecolor rgb '{}'",
                        2 * (mark++ % 6) + 5, alone ? "#009e73" : color),
            fs::path(image.file).filename().string(), {{image.seconds, image.errors.rmse}});
    }
  }
  return s;
}

}  // namespace

void remove_plots(const fs::path& folder, const std::string& name) {
  std::error_code ignored;
  for (const char* end : {".svg", ".png"}) fs::remove(folder / (name + end), ignored);
}

void check_gnuplot() {
  if (run_gnuplot({"--version"}) == 0) return;
  throw wisp::file_error("gnuplot", "",
                         "is not installed, and draws the plots of studies; install it (Debian and "
                         "Ubuntu: gnuplot-nox), or give --no-plots");
}

void plot_studies(std::span<const study_result> studies, std::span<const std::string> names,
                  const fs::path& folder, const std::string& name) {
  const script s = draw(studies, names);
  if (s.empty()) return;
  const auto beside = [&](const char* end) {
    return fs::absolute(folder / fmt::format(".wisp-{}-plot{}", getpid(), end));
  };
  const fs::path commands = beside(".gp"), svg = beside(".svg"), png = beside(".png");
  const std::string title = studies.size() == 1 ? studies[0].title : "error against time";
  save_text(commands, s.text(title, svg, png));
  const int status = run_gnuplot({"-d", commands.string()});
  std::error_code ignored, error;
  fs::remove(commands, ignored);
  if (status == 0) fs::rename(svg, folder / (name + ".svg"), error);
  if (status == 0 && !error) fs::rename(png, folder / (name + ".png"), error);
  if (status == 0 && !error) return;
  fs::remove(svg, ignored);
  fs::remove(png, ignored);
  throw wisp::file_error((folder / name).string(), "",
                         "gnuplot could not draw the plots; is there room, are there fonts?");
}
