// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "loopbit/record_run.hpp"

namespace loopbit::cli {

/// Prints what `loopbit run --json` finds on stdout, one JSON object per line, each as soon as it
/// is known; docs/run_folder.md lists the keys. Throws Error (kind output).
class JsonLines {
 public:
  /// Prints the frame if it is a loop.
  void add(const Detection& detection);

  /// Prints loops that are withdrawn after the last frame.
  void withdraw(const std::vector<LateLoop>& loops) const;

  /// Prints the last line. `report`: its file; may be empty.
  static void finish(const RunOutcome& run, const std::string& report);

 private:
  std::vector<std::string> names_;  ///< of the frames so far
};

}  // namespace loopbit::cli
