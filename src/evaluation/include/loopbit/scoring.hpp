// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/evaluation.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/truth_file.hpp"

namespace loopbit {

using FrameTimes = std::vector<std::optional<double>>;    ///< one per frame, if it has a time
using Positions = std::vector<std::optional<cv::Vec3d>>;  ///< one per frame, if it is known

/// The frames of a list of matches, as far as they are known.
struct FramesRead {
  int every = 1;            ///< only every N-th image of the input was read
  int views = 1;            ///< images per frame of the truth (2: left, right)
  FrameTimes times_s = {};  ///< empty if the frames are not listed
  bool all = false;         ///< see TruthOptions::all_read

  /// Only every N-th frame of the truth was read.
  [[nodiscard]] int every_of_truth() const;
};

/// The truth to score by, and how.
struct Scoring {
  std::optional<GroundTruth> truth = std::nullopt;
  EvaluationOptions evaluation = {};
};

/// What a caller calls the fields of a ScoringRequest, for error messages.
struct ScoringNames {
  const char* truth = "truth";
  const char* not_false = "not_false";
  const char* ignore = "ignore";
  const char* protocol = "protocol";
  const char* tolerance_frames = "tolerance_frames";
  const char* poses = "poses";
  const char* views = "views";
  const char* variable = "variable";
};

/// How the user wants matches to be scored. Fields are empty if the user did not set them.
struct ScoringRequest {
  std::string truth = {};      ///< a file of ground truth, see read_truth()
  std::string not_false = {};  ///< a file of matches that are not wrong, see read_place_runs()
  std::string ignore = {};     ///< a file of queries that are not scored, see read_frame_list()
  std::string protocol = {};   ///< fixes the tolerance, `poses` and `views`
  std::optional<int> tolerance_frames = std::nullopt;
  std::optional<PoseTruthOptions> poses = std::nullopt;
  std::optional<int> views = std::nullopt;
  std::string variable = {};
  ScoringNames names = {};

  /// What to score by: the files, if there is a file of truth, otherwise `known`, such as the
  /// truth of a run and how it was scored. Throws Error (kind option) if fields contradict each
  /// other or the kind of truth, otherwise as read_truth() does.
  [[nodiscard]] Scoring resolve(const FramesRead& frames, const Scoring& known = {}) const;

  /// Throws what resolve() would, as far as can be told before the frames are read. There will be
  /// `frames` of them, if that is known. `all`: see FramesRead.
  void check(int every, std::optional<std::size_t> frames, bool all) const;

  /// One line about the truth, for people; empty without a file of truth.
  [[nodiscard]] std::string description() const;

  /// `truth` if it is a file of poses, otherwise empty.
  [[nodiscard]] std::string poses_file() const;

 private:
  /// Throws Error (kind option) for fields that contradict each other, or need a file of truth.
  void check_fields(const std::string& known_protocol) const;
  void check_kind(TruthKind kind) const;
  [[nodiscard]] TruthOptions truth_options() const;
  [[nodiscard]] EvaluationOptions evaluation() const;
  [[nodiscard]] GroundTruth read(const FramesRead& frames) const;
  void add_others(GroundTruth& result) const;
};

}  // namespace loopbit
