// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
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
  double inlier_worth = 1;  ///< 0 to 1, see inlier_worth()
  double distinctness = 1;  ///< 0 to 1, see distinctness()

  /// That it shows the same place, in distinct inliers that count in full.
  [[nodiscard]] double evidence() const { return distinct_inliers * inlier_worth * distinctness; }
};

/// What is known of a frame whatever place it is compared with.
struct FrameContext {
  /// Changes of view that the map holds: how rare a thing is can be known no better than by one in
  /// so many, so that evidence counts less while a map is small.
  std::ptrdiff_t earlier_steps = 0;
  /// Distinct inliers that its view shares with the change of view before. That is what can be
  /// recognised of it: the same number found elsewhere says less of a view that has more.
  int view_inliers = 0;
};

/// What one distinct inlier counts, 0 to 1. `explained_share`: see there. 1 where mere matches are
/// counted.
double inlier_worth(double explained_share, const FrameContext& frame,
                    const DecisionOptions& options);

/// Agreement over time: a robot that revisits keeps revisiting, so the steps just before the query
/// (frames that changed the view) support its match if they verified against the same stretch of
/// the past, the less the longer ago. Steps are counted, not frames, because a frame that shows the
/// same as the one before is no second witness.
class Agreement {
 public:
  explicit Agreement(const DecisionOptions& options) : options_(options) {}

  /// The score of a verified candidate of the next frame: its evidence and, at a lower weight, the
  /// support of the steps before; 0 without evidence. `is_step`: the next frame is a step itself;
  /// else it shows what the last step showed, which then supports nothing. This number, and no
  /// other, is compared with decision.min_score.
  [[nodiscard]] double score(const VerifiedCandidate& verified, bool is_step) const;

  /// Notes the candidates of a step. Where some have evidence beyond chance, they say where the
  /// step is, and all other ways end; where none has, all go on. Else support would drift along a
  /// map of few places, of which nearly all are candidates.
  void remember(const std::vector<VerifiedCandidate>& step);

  /// A match at `step`, `steps_ago` steps before the last one, was wrong: ends all ways that it may
  /// have supported, unless it is so long ago that little of that is left.
  void withdraw(std::ptrdiff_t step, std::ptrdiff_t steps_ago);

  /// Where the ways that the robot may be following stood at the last step, those with most support
  /// first: at most `options.followed_ways`, far enough apart to be different ones, and none whose
  /// support has faded to less than one inlier.
  [[nodiscard]] std::vector<PlaceId> followed_places() const;

 private:
  /// The evidence of a way along the past, up to one of its steps.
  struct Trail {
    PlaceId place = 0;
    std::ptrdiff_t step = 0;
    double support = 0;
  };

  static double support_near(const std::vector<Trail>& trails, std::ptrdiff_t step);

  DecisionOptions options_;
  std::vector<Trail> latest_;         ///< one a way that goes on to the last step
  std::vector<Trail> before_latest_;  ///< of the step before
};

}  // namespace loopbit
