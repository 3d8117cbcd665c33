#include "console.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <string_view>
#include <system_error>

namespace {

// A signal handler can reach nothing but a static; lock-free atomics are allowed there.
std::atomic<bool> interrupted = false;

void on_interrupt(int) {
  if (interrupted.exchange(true)) {
    constexpr std::string_view text = "\nwisp: stopped at once, nothing saved\n";
    [[maybe_unused]] auto written = write(STDERR_FILENO, text.data(), text.size());
    _exit(130);
  }
}

}  // namespace

progress_line::progress_line(bool quiet) : active_(!quiet && isatty(STDERR_FILENO) != 0) {}
progress_line::~progress_line() { clear(); }

// Cut to one line of the terminal: what is wrapped could not be redrawn.
void progress_line::show(const std::string& whole) {
  if (!active_) return;
  winsize size = {};
  std::size_t columns = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1
                            ? size.ws_col - 1u
                            : whole.size();
  auto text = whole.substr(0, columns);
  drawn_ = std::min(drawn_, columns);
  std::string padding(drawn_ > text.size() ? drawn_ - text.size() : 0, ' ');
  fmt::print(stderr, "\r{}{}", text, padding);
  std::fflush(stderr);
  drawn_ = text.size();
}

void progress_line::clear() {
  if (!active_ || drawn_ == 0) return;
  fmt::print(stderr, "\r{}\r", std::string(drawn_, ' '));
  std::fflush(stderr);
  drawn_ = 0;
}

std::string format_duration(double seconds) {
  if (seconds < 60) return fmt::format("{:.1f} s", seconds);
  auto s = static_cast<long>(seconds + 0.5);
  if (s < 3600) return fmt::format("{} min {} s", s / 60, s % 60);
  return fmt::format("{} h {} min", s / 3600, s % 3600 / 60);
}

std::string format_bytes(double bytes) {
  if (bytes < 1e3) return fmt::format("{:.0f} B", bytes);
  if (bytes < 1e6) return fmt::format("{:.1f} kB", bytes / 1e3);
  if (bytes < 1e9) return fmt::format("{:.1f} MB", bytes / 1e6);
  return fmt::format("{:.2f} GB", bytes / 1e9);
}

void flush_results() {
  errno = 0;
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw wisp::file_error(
        "stdout", "", "cannot be written: " + std::generic_category().message(errno ? errno : EIO));
}

void print_warnings(const wisp::warning_list& warnings, bool quiet) {
  if (quiet) return;
  for (const auto& warning : warnings) fmt::print(stderr, "wisp: warning: {}\n", warning);
}

const std::atomic<bool>& interrupt_flag() { return interrupted; }

void watch_interrupts() {
  struct sigaction action = {};
  action.sa_handler = on_interrupt;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}
