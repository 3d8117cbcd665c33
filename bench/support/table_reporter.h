#pragma once

// A main for benchmarks with Google Benchmark that are compared with one another: it
// prints a table in place of Google Benchmark's, with nanoseconds per call, and how many
// times as fast as its rivals each benchmark is.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace wisp_bench {

struct table_row {
  std::string name;  // of a registered benchmark
  // The benchmarks that do the same work, the most important first: where that one was
  // run, the row says how many times as fast as it this one is, and, in brackets, the
  // same of the others that were run.
  std::vector<std::string> rivals;
};

struct table {
  std::string times;               // heading of the names: what the times are of
  std::string ratios;              // heading of the ratios
  int decimals = 2;                // of the ratios
  double calls_per_iteration = 1;  // times are divided by it
  std::vector<table_row> rows;     // in the order of the table
};

// Gathers the repetitions; the median is what counts. Rows that did not run are left out.
class table_reporter : public benchmark::BenchmarkReporter {
 public:
  explicit table_reporter(table t) : what(std::move(t)) {}
  bool ReportContext(const Context& context) override {
    PrintBasicContext(&GetErrorStream(), context);
    return true;
  }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const auto& run : runs)
      if (run.run_type == Run::RT_Iteration && !run.error_occurred)
        times[run.run_name.function_name].push_back(
            1e9 * run.cpu_accumulated_time / double(run.iterations) / what.calls_per_iteration);
  }
  void Finalize() override {
    for (auto& entry : times) std::sort(entry.second.begin(), entry.second.end());
    std::printf("%-42s %10s %10s   %s\n", what.times.c_str(), "median", "fastest",
                what.ratios.c_str());
    for (const auto& row : what.rows) {
      if (!times.count(row.name)) continue;
      std::printf("%-42s %10.1f %10.1f", row.name.c_str(), median(row.name),
                  times[row.name].front());
      print_ratios(row);
      std::printf("\n");
    }
  }

 private:
  double median(const std::string& name) { return times[name][times[name].size() / 2]; }
  void print_ratios(const table_row& row) {
    if (row.rivals.empty() || !times.count(row.rivals[0])) return;
    for (std::size_t i = 0; i < row.rivals.size(); i++)
      if (times.count(row.rivals[i]))
        std::printf(i == 0 ? "   %.*f" : " (%.*f)", what.decimals,
                    median(row.rivals[i]) / median(row.name));
  }

  table what;
  std::map<std::string, std::vector<double>> times;
};

// Runs what is registered, with the options of Google Benchmark in argv, and prints the
// table. What it returns is for main to return: 1 for an unknown option.
inline int run_table(int argc, char** argv, table t) {
  // Repetitions in random order, so that what else the machine does hits all alike.
  std::vector<std::string> words = {argv[0], "--benchmark_repetitions=9",
                                    "--benchmark_min_time=0.1",
                                    "--benchmark_enable_random_interleaving=true"};
  words.insert(words.end(), argv + 1, argv + argc);
  std::vector<char*> pointers;
  for (auto& word : words) pointers.push_back(word.data());
  int count = int(pointers.size());
  benchmark::Initialize(&count, pointers.data());
  if (benchmark::ReportUnrecognizedArguments(count, pointers.data())) return 1;
  table_reporter reporter(std::move(t));
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();
  return 0;
}

}  // namespace wisp_bench
