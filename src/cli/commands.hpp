// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/CLI.hpp>

namespace loopbit::cli {

/// What the command exits with; the README and `loopbit --help` list the same.
enum ExitCode : int {
  success = 0,
  internal_error = 1,
  bad_option = 2,
  bad_input = 3,
  bad_output = 4,
  interrupted = 130,
};

/// Each adds a sub-command to `app` that leaves its exit code in `exit_code` and throws
/// loopbit::Error.
void add_run(CLI::App& app, int& exit_code);
void add_demo(CLI::App& app, int& exit_code);
void add_options(CLI::App& app);

}  // namespace loopbit::cli
