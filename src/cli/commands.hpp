// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "loopbit/options.hpp"

namespace loopbit::cli {

/// Exit codes of the command; docs/run_folder.md and `loopbit --help` list them.
enum ExitCode : int {
  success = 0,
  internal_error = 1,
  bad_option = 2,
  bad_input = 3,
  bad_output = 4,
  interrupted = 130,
};

/// Each adds a sub-command to `app` that leaves its exit code in `exit_code` and throws
/// loopbit::Error. `arguments`: all of the command line after the program's name, for the record of
/// a run.
using Arguments = std::vector<std::string>;
void add_run(CLI::App& app, const Arguments& arguments, int& exit_code);
void add_demo(CLI::App& app, const Arguments& arguments, int& exit_code);
void add_query(CLI::App& app, int& exit_code);
void add_map(CLI::App& app, int& exit_code);
void add_graph(CLI::App& app);
void add_pairs(CLI::App& app);
void add_eval(CLI::App& app);
void add_compare(CLI::App& app);
void add_report(CLI::App& app);
void add_topics(CLI::App& app);
void add_options(CLI::App& app);

/// Throws Error (kind option) if the file that one of the options `outputs` names would replace
/// what `command` reads: the value of another option or, if that is a folder, a run's file or an
/// image in it. The page of a run may be replaced.
void protect_inputs(const CLI::App& command, const std::vector<std::string>& outputs);

/// Makes options of `app` and its commands refuse an empty value, as an unset shell variable gives.
void refuse_empty_values(CLI::App& app);

/// "NAME=VALUE" in two. Throws Error (kind option) without a "=".
std::pair<std::string, std::string> split_setting(const std::string& text);

/// The fields of an options struct under a title, one a line.
template <typename Options>
std::string list_settings(std::string_view title) {
  std::string list = fmt::format("{}:\n", title);
  for_each_field<Options>([&](const auto& field) {
    list += fmt::format("  {} = {}  [{} to {}] {}\n", field.name, Options{}.*field.member,
                        field.min, field.max, field.help);
  });
  return list;
}

/// Replaces CLI::Range, which accepts nan and has a misleading message for 2.5 in 1 to 9.
CLI::Validator whole_number(std::int64_t min, std::int64_t max);
CLI::Validator number(double min, double max);

}  // namespace loopbit::cli
