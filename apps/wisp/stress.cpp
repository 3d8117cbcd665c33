#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "commands.h"
#include "console.h"
#include "run_report.h"
#include "stress_geometry.h"
#include "stress_hair.h"
#include "stress_pde.h"

namespace {

struct stress_arguments {
  stress_options options;
  std::string out;
  bool quiet = false;
};

int run_stress(const stress_arguments& args) {
  progress_line line(args.quiet);
  auto options = args.options;
  options.progress = [&](const std::string& text) { line.show(text); };
  auto rows = stress_hair(options);
  const auto geometry = stress_geometry(options);
  rows.insert(rows.end(), geometry.begin(), geometry.end());
  const auto pde = stress_pde(options);
  rows.insert(rows.end(), pde.begin(), pde.end());
  line.clear();
  auto failed = std::count_if(rows.begin(), rows.end(), [](const auto& r) { return !passes(r); });
  auto text =
      fmt::format("wisp {}, {} random calls, seed {}\n\n{}\n{} cases, {} failed\n", WISP_VERSION,
                  args.options.calls, args.options.seed, stress_table(rows), rows.size(), failed);
  fmt::print("{}", text);
  if (!args.out.empty()) save_text(args.out, text);
  return failed == 0 ? 0 : exit_fault;
}

}  // namespace

command_action add_stress(CLI::App& app) {
  auto args = std::make_shared<stress_arguments>();
  args->options.calls = 50000000;
  auto* cmd = app.add_subcommand("stress",
                                 "Compute stiff and extreme cases and hold them to their answers");
  cmd->footer(
      "Example:\n  wisp stress -o table.md\n"
      "Prints a Markdown table. The exit status is 1 if a case fails. The table is the same at "
      "any number of threads.");
  cmd->add_option(
         "--calls", args->options.calls,
         "Random calls of the hair model; below five million also fewer points of geometry")
      ->check(CLI::Range(uint64_t(1), uint64_t(1) << 40))
      ->capture_default_str();
  cmd->add_option("--seed", args->options.seed, "Seed of the random calls")->capture_default_str();
  cmd->add_option("--threads", args->options.threads, "Threads (0: all)")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  cmd->add_option("-o,--out", args->out, "Also write the table to this file");
  cmd->add_flag("--quiet", args->quiet, "No progress");
  return [args] { return run_stress(*args); };
}
