// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <deque>
#include <vector>

#include "loopbit/loop_detector_options.hpp"
#include "loopbit/place_index.hpp"

namespace loopbit {

/// What verification found for one candidate of one frame.
struct VerifiedCandidate {
  Candidate candidate;
  int matches = 0;
  int inliers = 0;
  int distinct_inliers = 0;
};

/// The verified candidates of the last few frames. A robot that revisits keeps revisiting, so
/// frames just before the query that verified against the same stretch of the past support its
/// match.
class Agreement {
 public:
  explicit Agreement(const DecisionOptions& options) : options_(options) {}

  /// The score of a verified candidate of the next frame: its distinct inliers, and those beyond
  /// chance of the best neighbouring candidate in each of the frames before, at a lower weight. 0
  /// without inliers. This number, and no other, is compared with decision.min_score.
  [[nodiscard]] double score(const VerifiedCandidate& verified) const;

  /// Notes the candidates of a frame (none for a frame without image).
  void remember(std::vector<VerifiedCandidate> frame);

 private:
  DecisionOptions options_;
  std::deque<std::vector<VerifiedCandidate>> recent_;  ///< the latest frame last
};

}  // namespace loopbit
