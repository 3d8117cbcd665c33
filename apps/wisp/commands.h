#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

// Each subcommand adds itself to the parser and gives back what to run, which
// returns the exit status.
using command_action = std::function<int()>;

command_action add_render(CLI::App& app, const std::string& command_line);
command_action add_solve(CLI::App& app, const std::string& command_line);
command_action add_study(CLI::App& app, const std::string& command_line);
command_action add_info(CLI::App& app);
command_action add_convert(CLI::App& app);
command_action add_stress(CLI::App& app);

inline constexpr int exit_fault = 1;
inline constexpr int exit_usage = 2;
inline constexpr int exit_interrupted = 130;

// Thrown for wrong use that only shows once the scene is known.
struct usage_error : std::runtime_error {
  using std::runtime_error::runtime_error;
};
