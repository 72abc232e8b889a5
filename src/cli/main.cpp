// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <opencv2/core/utils/logger.hpp>
#include <unistd.h>

#include "loopbit/error.hpp"
#ifdef LOOPBIT_HAS_FLEET
#include "loopbit/fleet_map.hpp"
#endif
#include "loopbit/map_server.hpp"
#include "loopbit/version.hpp"
#include "loopbit/write_file.hpp"

#include "commands.hpp"
#include "process.hpp"

namespace {

using loopbit::ErrorKind;
namespace cli = loopbit::cli;

constexpr const char* kFooter =
    "Exit codes: 0 success; 1 internal error; 2 invalid option or setting; 3 input missing or "
    "damaged, or a server did not answer; 4 output cannot be written; 130 interrupted, results so "
    "far are kept.";

/// Column of the text that explains what a line of help begins with, after two or more spaces; the
/// line's own indent if there is none.
std::size_t hanging_indent(const std::string& line, std::size_t width) {
  const std::size_t begin = line.find_first_not_of(' ');
  if (begin == std::string::npos) return 0;
  const std::size_t gap = line.find("  ", begin);
  const std::size_t text = gap == std::string::npos ? gap : line.find_first_not_of(' ', gap);
  return text <= width / 2 ? text : begin;
}

/// CLI11's help, with lines broken between words where the terminal ends.
class Help : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    constexpr std::size_t kLeast = 60;
    constexpr std::size_t kMost = 100;
    const std::size_t width = std::clamp(cli::terminal_columns(STDOUT_FILENO), kLeast, kMost);
    std::istringstream lines(CLI::Formatter::make_help(app, std::move(name), mode));
    std::string text;
    for (std::string line; std::getline(lines, line);) {
      const std::size_t indent = hanging_indent(line, width);
      while (line.size() > width) {
        const std::size_t end = line.rfind(' ', width);
        if (end == std::string::npos || end <= indent) break;
        text += line.substr(0, end) + '\n';
        line = std::string(indent, ' ') + line.substr(end + 1);
      }
      text += line + '\n';
    }
    return text;
  }
};

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

/// CLI11 says of an unknown word in a command's place only that a command is required. `name`: of
/// `app`, whose command or option stands at argv[at].
void check_command(const CLI::App& app, const std::string& name, int at, int argc, char** argv) {
  if (at >= argc) return;
  const std::string word = argv[at];
  const bool is_option = word.starts_with('-');
  if (is_option && app.get_option_no_throw(word)) return;
  for (const CLI::App* command :
       app.get_subcommands([&](const CLI::App* one) { return one->check_name(word); })) {
    if (command->get_require_subcommand_min() == 0) return;
    return check_command(*command, fmt::format("{} {}", name, word), at + 1, argc, argv);
  }
  throw loopbit::Error(
      ErrorKind::option,
      fmt::format("There is no {} '{}'; '{} --help' lists them.", is_option ? "option" : "command",
                  loopbit::without_secrets(word), name));
}

int run_command_line(int argc, char** argv) {
#ifdef LOOPBIT_HAS_FLEET
  loopbit::use_fleet_maps();
#endif
  CLI::App app{
      "loopbit detects visual loop closures: whether a camera is back at an earlier place."};
  app.formatter(std::make_shared<Help>());
  app.footer(kFooter);
  app.set_version_flag("--version", loopbit::kVersion);
  app.require_subcommand(1);
  int exit_code = cli::success;
  const cli::Arguments arguments(argv + std::min(argc, 1), argv + argc);
  cli::add_run(app, arguments, exit_code);
  cli::add_demo(app, arguments, exit_code);
  cli::add_query(app, exit_code);
  cli::add_map(app, exit_code);
  cli::add_graph(app);
  cli::add_pairs(app);
  cli::add_eval(app);
  cli::add_compare(app);
  cli::add_report(app);
  cli::add_topics(app);
  cli::add_options(app);
  cli::refuse_empty_values(app);
  check_command(app, "loopbit", 1, argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    std::ostringstream printed;
    std::ostringstream told;
    std::string line;
    const int code = app.exit(error, printed, told);
    fmt::print("{}", printed.str());
    for (std::istringstream lines(told.str()); std::getline(lines, line);) {
      cli::tell(loopbit::without_secrets(line) + '\n');
    }
    return code == 0 ? cli::success : cli::bad_option;
  }
  return exit_code;
}

/// What is printed counts as done when it is out.
int run_and_flush(int argc, char** argv) {
  int exit_code = cli::success;
  try {
    exit_code = run_command_line(argc, argv);
  } catch (const std::system_error& error) {  // from fmt::print
    if (std::ferror(stdout) == 0) throw;
    throw loopbit::cannot_write("standard output", error.code().value());
  }
  cli::flush_stdout();
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  // Bad images are reported by loopbit, in its own words.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  // Past a file size limit, let write() fail, which is reported as any full disk is.
  std::signal(SIGXFSZ, SIG_IGN);
  cli::keep_closed_streams_closed();
  cli::keep_libraries_quiet();
  try {
    return run_and_flush(argc, argv);
  } catch (const loopbit::Error& error) {
    cli::tell(fmt::format("loopbit: {}\n", error.what()));
    return exit_code_of(error.kind());
  } catch (const std::exception& error) {
    cli::tell(fmt::format("loopbit: internal error, please report it: {}\n", error.what()));
    return cli::internal_error;
  }
}
