// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <opencv2/core.hpp>

#include "loopbit/evaluation.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/truth_file.hpp"

namespace loopbit::cli {

/// One a frame, empty where a frame has none; an empty list where the frames are not known.
using FrameTimes = std::vector<std::optional<double>>;
using Positions = std::vector<std::optional<cv::Vec3d>>;

/// The flags of every command that scores.
struct TruthFlags {
  std::string truth;
  std::string not_false;
  std::string ignore;
  std::string poses;
  std::string protocol;
  std::string variable;
  int views = 1;
  int tolerance_frames = 0;
  std::vector<std::string> settings;  ///< of PoseTruthOptions, "name=value"

  void add_to(CLI::App& command);
  /// The flag for poses, of commands that make a report.
  void add_poses_to(CLI::App& command);

  [[nodiscard]] bool given() const { return !truth.empty(); }

  /// All files the flags name; some may be empty.
  [[nodiscard]] std::vector<std::string> files() const { return {truth, not_false, ignore, poses}; }

  /// What the protocol says, else what the flags say. Throws Error (kind option) where both speak.
  [[nodiscard]] EvaluationOptions evaluation() const;

  /// Throws what read_truth() and read_positions() would, as far as can be told before the frames
  /// are read: of the sequence every `every`-th will be, so many of them if that is known, which
  /// are all it has if `all_read`.
  void check(int every, std::optional<std::size_t> frames, bool all_read = false) const;

  /// One line that says what is true; empty if no file was named.
  [[nodiscard]] std::string description() const;

  /// What is true about the sequence, if a file was named, of which every `every`-th frame was
  /// read, see TruthOptions::all_read.
  [[nodiscard]] std::optional<GroundTruth> read_truth(const FrameTimes& times_s, int every,
                                                      bool all_read = false) const;

  /// Where the camera was, if poses were named, as such or as the truth; else nothing. Where the
  /// frames are not known, every pose is one.
  [[nodiscard]] Positions read_positions(const FrameTimes& times_s, int every) const;

 private:
  [[nodiscard]] TruthOptions truth_options(int every) const;
  [[nodiscard]] std::string poses_file() const;
  /// Adds what --not-false and --ignore say.
  void add_others(GroundTruth& result) const;
  /// Throws Error (kind option) if the protocol or a flag is not defined on `kind`.
  void check_kind(TruthKind kind) const;

  CLI::Option* fixed_by_protocol_[3] = {};
};

/// The settings of PoseTruthOptions and the protocols, for a command's footer.
std::string list_truth_settings();

}  // namespace loopbit::cli
