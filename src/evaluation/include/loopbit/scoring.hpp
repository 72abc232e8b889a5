// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "loopbit/evaluation.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/truth_file.hpp"

namespace loopbit {

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

  /// Throws what resolve() would, as far as can be told before the `frames` are read, with their
  /// number but without their times.
  void check(const FramesRead& frames) const;

  /// One line about the truth, for people; empty without a file of truth.
  [[nodiscard]] std::string description() const;

  /// `given`, or, if that is empty, `truth` if it is a file of poses; otherwise empty.
  [[nodiscard]] std::string poses_file(const std::string& given = {}) const;

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
