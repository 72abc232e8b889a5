// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "loopbit/scoring.hpp"

namespace loopbit::cli {

/// The flags of every command that scores.
struct TruthFlags {
  ScoringRequest scoring;
  std::string poses;  ///< a file, for the trajectory in the report

  void add_to(CLI::App& command);
  /// The flag for poses, of commands that make a report.
  void add_poses_to(CLI::App& command);

  /// All files the flags name; some may be empty.
  [[nodiscard]] std::vector<std::string> files() const {
    return {scoring.truth, scoring.not_false, scoring.ignore, poses};
  }

  /// Throws what ScoringRequest::resolve() and read_positions() would, see ScoringRequest::check().
  void check(int every, std::optional<std::size_t> frames, bool all = false) const;

  /// Where the camera was, if poses were named, as such or as the truth; else nothing. Where the
  /// frames are not known, every pose is one.
  [[nodiscard]] Positions read_positions(const FramesRead& frames) const;
};

/// The settings of PoseTruthOptions and the protocols, for a command's footer.
std::string list_truth_settings();

}  // namespace loopbit::cli
