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
  for (const int fd : {1, 2})
    posix_spawn_file_actions_addopen(&actions, fd, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, "gnuplot", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return -1;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// A string of gnuplot: single quotes are doubled, and control characters left out.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20) continue;
    result += c == '\'' ? "''" : std::string(1, c);
  }
  return result + "'";
}

// Places of an axis with their labels: 1, 2 and 5 of each power of ten, or powers alone.
std::string ticks(double low, double high) {
  const double decades = std::log10(high / low);
  const int every = std::max(1, static_cast<int>(decades / 8));
  std::string list;
  for (int e = static_cast<int>(std::floor(std::log10(low))) - 1;
       e <= static_cast<int>(std::ceil(std::log10(high))); ++e) {
    for (const int digit : {1, 2, 5}) {
      if (decades > 3 && (digit != 1 || e % every != 0)) continue;
      const double at = digit * std::pow(10, e);
      list += fmt::format("{}'{:.3g}' {:.9g}", list.empty() ? "(" : ", ", at, at);
    }
  }
  return list + ")";
}

struct curve {
  std::string block, style, title;
};

class script {
 public:
  void add(const std::string& style, const std::string& title,
           const std::vector<std::pair<double, double>>& points) {
    std::string rows;
    for (const auto& [x, y] : points) {
      if (!(x > 0) || !(y > 0) || !std::isfinite(x) || !std::isfinite(y)) continue;
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
      plot += fmt::format("{}{} using 1:2 {} {}", plot.empty() ? "plot " : ", \\\n  ", c.block,
                          c.style, c.title.empty() ? "notitle" : "title " + quoted(c.title));
    }
    // a guide through the middle of the picture
    const double x = std::sqrt(low_.first * high_.first), y = std::sqrt(low_.second * high_.second);
    plot += fmt::format(
        ", \\\n  {:.9g} * (x / {:.9g})**-0.5 with lines linecolor rgb '#bbbbbb' dashtype 3 "
        "linewidth 1.5 title 'slope -1/2'\n",
        y, x);
    // room around the data
    const auto room = [](double low, double high) {
      const double by = std::max(1.3, std::pow(high / low, 0.06));
      return fmt::format("[{:.9g}:{:.9g}]", low / by, high * by);
    };
    std::string result = data_;
    result += fmt::format(
        "set logscale xy\nset xrange {}\nset yrange {}\nset xtics {}\nset ytics {}\n"
        "set xlabel 'seconds of estimating' offset 0,0.4\nset ylabel 'root mean square error'\n"
        "set grid xtics ytics linewidth 0.6 linecolor rgb '#cccccc' dashtype 1\n"
        "set border linewidth 0.8 linecolor rgb '#666666'\nset tics textcolor rgb '#333333'\n"
        "set key below Left reverse noenhanced maxrows 4\nset title {} noenhanced\n"
        "set samples 200\n",
        room(low_.first, high_.first), room(low_.second, high_.second),
        ticks(low_.first, high_.first), ticks(low_.second, high_.second), quoted(title));
    result += fmt::format(
        "set terminal svg size 860,620 dynamic font 'Helvetica,15' background '#ffffff'\n"
        "set output {}\n{}set output\n"
        "set terminal pngcairo size 1290,930 font ',17' background '#ffffff'\n"
        "set output {}\nreplot\nset output\n",
        quoted(svg.string()), plot, quoted(png.string()));
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
    s.add(fmt::format("with points pointtype 7 pointsize 0.7 linecolor rgb '{}'", color), "", runs);
    s.add(fmt::format("with lines linewidth 2.2 linecolor rgb '{}'", color),
          alone ? "error against the reference" : names[i], rows);
    if (alone) {
      s.add("with lines linewidth 1.8 dashtype 2 linecolor rgb '#d55e00'",
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

void check_gnuplot() {
  if (run_gnuplot({"--version"}) == 0) return;
  throw wisp::file_error("gnuplot", "",
                         "is not installed, and draws the plots of studies; install it (Debian and "
                         "Ubuntu: gnuplot-nox), or give --no-plots");
}

void plot_studies(std::span<const study_result> studies, std::span<const std::string> names,
                  const fs::path& folder, const std::string& name) {
  const script s = draw(studies, names);
  if (s.empty()) {
    throw wisp::file_error((folder / name).string(), "",
                           "cannot be drawn: no run has an error above 0");
  }
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
