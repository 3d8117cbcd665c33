#pragma once

#include <atomic>
#include <string>

#include "wisp/core/error.h"

// The progress line on stderr: redraws itself on a terminal, silent elsewhere.
class progress_line {
 public:
  explicit progress_line(bool quiet);
  ~progress_line();
  progress_line(const progress_line&) = delete;
  progress_line& operator=(const progress_line&) = delete;

  bool active() const { return active_; }
  void show(const std::string& text);
  void clear();

 private:
  bool active_ = false;
  std::size_t drawn_ = 0;
};

// "3.2 s", "4 min 10 s", "1 h 5 min".
std::string format_duration(double seconds);
// "12 kB", "3.4 MB".
std::string format_bytes(double bytes);

// Throws if what was printed to stdout did not get there (a full disk).
void flush_results();

void print_warnings(const wisp::warning_list& warnings, bool quiet);

// Becomes true at the first Ctrl-C; the second one ends the program at once.
const std::atomic<bool>& interrupt_flag();
void watch_interrupts();
