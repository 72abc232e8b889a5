// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "loopbit/poses.hpp"
#include "loopbit/scoring.hpp"

namespace loopbit::cli {

/// The flags of every command that scores.
struct TruthFlags {
  ScoringRequest scoring;
  std::string poses;  ///< a file, for the trajectory in the report

  void add_to(CLI::App& command);
  /// The flag for poses, of commands that make a report.
  void add_poses_to(CLI::App& command);

  /// Where the camera was, if poses were named, as such or as the truth; else nothing. Where the
  /// frames are not known, every pose is one.
  [[nodiscard]] Positions read_positions(const FramesRead& frames) const;

 private:
  /// How the file of the flag `truth` is read, and matches judged by it.
  void add_rules_to(CLI::App& command, CLI::Option* truth);
};

/// The settings of PoseTruthOptions and the protocols, for a command's footer.
std::string list_truth_settings();

}  // namespace loopbit::cli
