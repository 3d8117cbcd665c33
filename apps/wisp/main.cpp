#include <fcntl.h>
#include <fmt/format.h>

#include <cerrno>
#include <exception>
#include <new>
#include <string>

#include "commands.h"
#include "render_component.h"
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

// A file that is opened while one of them is closed would get its number, and
// what is printed.
void open_standard_streams() {
  for (int fd = 0; fd <= 2; fd++)
    if (fcntl(fd, F_GETFD) < 0 && errno == EBADF && open("/dev/null", O_RDWR) != fd) return;
}

// The number, and what is in.
std::string version_text() {
  return std::string("wisp " WISP_VERSION "\ncomponents: core, hair, geometry, pde, scene") +
         (has_render ? ", render" : "; without render");
}

}  // namespace

int main(int argc, char** argv) {
  open_standard_streams();
  CLI::App app("wisp: path-traced hair, and PDEs without a volume mesh", "wisp");
  app.set_version_flag("--version", version_text());
  app.require_subcommand(1);
  app.footer("Each command has its own --help with an example.");
  command_action render;
  if constexpr (has_render) render = add_render(app, quote_command(argc, argv));
  auto solve = add_solve(app, quote_command(argc, argv));
  auto study = add_study(app, quote_command(argc, argv));
  auto info = add_info(app);
  auto convert = add_convert(app);
  auto stress = add_stress(app);

  std::string commands;
  bool known = argc < 2 || argv[1][0] == '-';
  for (const auto* command : app.get_subcommands([](CLI::App*) { return true; })) {
    known = known || command->get_name() == argv[1];
    commands += (commands.empty() ? "" : ", ") + command->get_name();
  }
  if (!has_render && !known && std::string(argv[1]) == "render") {
    fmt::print(stderr, "wisp: {}; these commands work: {}\n", needs_render("the command 'render'"),
               commands);
    return exit_usage;
  }
  if (!known) {
    fmt::print(stderr, "wisp: there is no command '{}', but these: {}\nRun 'wisp --help'.\n",
               argv[1], commands);
    return exit_usage;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return app.exit(success);  // --help, --version
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "wisp: {}\nRun 'wisp --help' or 'wisp COMMAND --help'.\n", error.what());
    return exit_usage;
  }

  try {
    if (render && app.got_subcommand("render")) return render();
    if (app.got_subcommand("solve")) return solve();
    if (app.got_subcommand("study")) return study();
    if (app.got_subcommand("info")) return info();
    if (app.got_subcommand("stress")) return stress();
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
