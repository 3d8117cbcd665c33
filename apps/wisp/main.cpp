#include <fmt/format.h>

#include <exception>
#include <new>
#include <string>

#include "commands.h"
#include "wisp/core/error.h"

namespace {

// The command as it could be typed again.
std::string quote_command(int argc, char** argv) {
  std::string line = "wisp";
  for (int i = 1; i < argc; i++) {
    std::string arg = argv[i];
    bool plain =
        !arg.empty() && arg.find_first_of(" \t\n'\"\\$&|;<>()*?[]#~`!{}") == std::string::npos;
    if (plain) {
      line += " " + arg;
      continue;
    }
    line += " '";
    for (char c : arg) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += "'";
  }
  return line;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("wisp: path-traced hair, and PDEs without a volume mesh", "wisp");
  app.set_version_flag("--version", "wisp " WISP_VERSION);
  app.require_subcommand(1);
  app.footer("Each command has its own --help with an example.");
  auto render = add_render(app, quote_command(argc, argv));
  auto info = add_info(app);
  auto convert = add_convert(app);

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return app.exit(success);  // --help, --version
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "wisp: {}\nRun 'wisp --help' or 'wisp COMMAND --help'.\n", error.what());
    return exit_usage;
  }

  try {
    if (app.got_subcommand("render")) return render();
    if (app.got_subcommand("info")) return info();
    return convert();
  } catch (const usage_error& error) {
    fmt::print(stderr, "wisp: {}\n", error.what());
    return exit_usage;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "wisp: error: out of memory\n");
  } catch (const std::exception& error) {
    fmt::print(stderr, "wisp: error: {}\n", error.what());
  }
  return exit_fault;
}
