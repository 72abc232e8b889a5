// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <csignal>
#include <cstdio>
#include <exception>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <opencv2/core/utils/logger.hpp>

#include "loopbit/error.hpp"
#include "loopbit/version.hpp"

#include "commands.hpp"

namespace {

using loopbit::ErrorKind;
namespace cli = loopbit::cli;

constexpr const char* kFooter =
    "Exit codes: 0 done; 2 bad option or setting; 3 input missing or unreadable; 4 output cannot "
    "be "
    "written;\n130 interrupted, with what was found until then kept; 1 a fault in loopbit.";

int exit_code_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::option:
      return cli::bad_option;
    case ErrorKind::input:
      return cli::bad_input;
    case ErrorKind::output:
      return cli::bad_output;
  }
  return cli::internal_error;
}

/// CLI11 says of an unknown command only that one is required.
void check_command(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  const auto is_named = [&](const CLI::App* command) { return command->check_name(argv[1]); };
  if (!app.get_subcommands(is_named).empty()) return;
  throw loopbit::Error(
      ErrorKind::option,
      fmt::format("There is no command '{}'; see 'loopbit --help' for those there are.", argv[1]));
}

int run_command_line(int argc, char** argv) {
  CLI::App app{"loopbit tells a robot, image by image, whether it has been here before."};
  app.footer(kFooter);
  app.set_version_flag("--version", loopbit::kVersion);
  app.require_subcommand(1);
  int exit_code = cli::success;
  cli::add_run(app, exit_code);
  cli::add_demo(app, exit_code);
  cli::add_query(app, exit_code);
  cli::add_map(app, exit_code);
  cli::add_eval(app);
  cli::add_compare(app);
  cli::add_report(app);
  cli::add_reproduce(app, exit_code);
  cli::add_options(app);
  check_command(app, argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? cli::success : cli::bad_option;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  // Bad images are reported by loopbit, in its own words.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  // Past a file size limit, let write() fail, which is reported as any full disk is.
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    return run_command_line(argc, argv);
  } catch (const loopbit::Error& error) {
    fmt::print(stderr, "loopbit: {}\n", error.what());
    return exit_code_of(error.kind());
  } catch (const std::exception& error) {
    fmt::print(stderr, "loopbit: internal error, please report it: {}\n", error.what());
    return cli::internal_error;
  }
}
