// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/printable.hpp"

#include "commands.hpp"
#include "process.hpp"
#include "run_list.hpp"
#include "session.hpp"

namespace loopbit::cli {
namespace {

struct ReportFlags {
  std::string run;
  std::string out;
  TruthFlags truth;
  ReportOptions report;
  bool open = false;
};

void report_command(const ReportFlags& flags) {
  const ReportRun run = report_run(flags.run, flags.truth);
  std::string path = flags.out;
  if (path.empty()) {
    if (!run.run) {
      throw Error(ErrorKind::option,
                  fmt::format("'{}' is not a run folder; add --out FILE for the page.", flags.run));
    }
    path = report_in(flags.run);
  }
  write_report(path, {run}, flags.report);
  std::error_code no_file;  // but a device or a pipe
  const auto bytes = std::filesystem::file_size(path, no_file);
  fmt::print("report     {}{}\n", printable(path),
             no_file ? "" : fmt::format(" ({:.1f} MB)", static_cast<double>(bytes) / 1e6));
  if (flags.open) open_page(path);
}

}  // namespace

void add_report(CLI::App& app) {
  auto flags = std::make_shared<ReportFlags>();
  CLI::App* command = app.add_subcommand("report", "Write an HTML page that shows a run");
  command
      ->add_option("RUN", flags->run,
                   "A run folder, or a CSV file of query,match[,score] of another detector")
      ->required();
  command->add_option("--out", flags->out, "Output file; default RUN/report.html")
      ->type_name("FILE");
  command->add_flag("--open", flags->open, "Open the page in the browser");
  add_report_flag(*command, flags->report);
  flags->truth.add_to(*command);
  flags->truth.add_poses_to(*command);
  command->footer(list_truth_settings());
  command->callback([command, flags] {
    protect_inputs(*command, {"--out"});
    report_command(*flags);
  });
}

}  // namespace loopbit::cli
