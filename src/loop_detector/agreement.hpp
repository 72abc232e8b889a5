// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "loopbit/loop_detector_options.hpp"
#include "loopbit/place_index.hpp"

namespace loopbit {

/// What verification found for one candidate of one frame.
struct VerifiedCandidate {
  Candidate candidate;
  std::ptrdiff_t step = 0;  ///< the candidate's position along the path, see RecentView::step_of
  int matches = 0;
  int inliers = 0;
  int distinct_inliers = 0;
};

/// The verified candidates of the last few steps: frames that changed the view. A robot that
/// revisits keeps revisiting, so steps just before the query that verified against the same stretch
/// of the past support its match. Steps are counted, not frames, because a frame that shows the
/// same as the one before is no second witness.
class Agreement {
 public:
  explicit Agreement(const DecisionOptions& options) : options_(options) {}

  /// The score of a verified candidate of the next frame: its distinct inliers, and those beyond
  /// chance of the best neighbouring candidate in each of the steps before, at a lower weight. 0
  /// without inliers. `is_step`: the next frame is a step itself; else it shows what the last step
  /// showed, which then supports nothing. This number, and no other, is compared with
  /// decision.min_score.
  [[nodiscard]] double score(const VerifiedCandidate& verified, bool is_step) const;

  /// Notes the candidates of a step.
  void remember(std::vector<VerifiedCandidate> step);

 private:
  DecisionOptions options_;
  std::deque<std::vector<VerifiedCandidate>> recent_;  ///< the latest step last
};

}  // namespace loopbit
