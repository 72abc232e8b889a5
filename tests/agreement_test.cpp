// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "agreement.hpp"

#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

namespace loopbit::test {
namespace {

/// Half of the support adds to the score and half of it is left after a step; 8 is chance.
DecisionOptions halves() {
  return {.chance_evidence = 8, .agreement_weight = 0.5, .agreement_memory = 0.5};
}

/// Only the distinct inliers are evidence, and only steps tell how far places are apart.
VerifiedCandidate candidate(std::ptrdiff_t step, int distinct_inliers) {
  return {.candidate = {static_cast<PlaceId>(7 * step), 0.5},
          .step = step,
          .matches = 300,
          .inliers = distinct_inliers == 0 ? 0 : 200,
          .distinct_inliers = distinct_inliers};
}

/// The score of a candidate at the step 100 with 15 inliers, in a frame that changes the view.
double score_of_next_step(const Agreement& agreement) {
  return agreement.score(candidate(100, 15), true);
}

TEST(Agreement, ScoreOfTheFirstFrameIsItsEvidence) {
  EXPECT_DOUBLE_EQ(score_of_next_step(Agreement(halves())), 15);
  EXPECT_DOUBLE_EQ(Agreement(halves()).score(candidate(100, 15), false), 15);
}

TEST(Agreement, StepsBeforeAddTheirEvidenceBeyondChanceTheLessTheLongerAgo) {
  Agreement agreement(halves());
  agreement.remember({candidate(97, 48)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15 + 0.5 * 40);
  agreement.remember({candidate(98, 18)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15 + 0.5 * (10 + 20));
  agreement.remember({candidate(99, 28)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15 + 0.5 * (20 + 5 + 10));
}

TEST(Agreement, CountsEvidenceNotInliers) {
  VerifiedCandidate half = candidate(99, 56);
  half.inlier_worth = 0.5;
  Agreement agreement(halves());
  agreement.remember({half});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15 + 0.5 * 20);
  half.distinctness = 0.5;
  EXPECT_DOUBLE_EQ(agreement.score(half, true), 14 + 0.5 * 20);
}

TEST(Agreement, FrameThatShowsTheLastStepAgainIsNotSupportedByIt) {
  Agreement agreement(halves());
  agreement.remember({candidate(98, 18)});
  EXPECT_DOUBLE_EQ(agreement.score(candidate(100, 15), false), 15);
  agreement.remember({candidate(99, 28)});
  EXPECT_DOUBLE_EQ(agreement.score(candidate(100, 15), false), 15 + 0.5 * 10);
}

TEST(Agreement, StandingStillKeepsTheScore) {
  Agreement agreement(halves());
  agreement.remember({candidate(97, 12)});
  agreement.remember({candidate(98, 18)});
  const double moving = score_of_next_step(agreement);
  agreement.remember({candidate(100, 15)});
  EXPECT_DOUBLE_EQ(agreement.score(candidate(100, 15), false), moving);
}

TEST(Agreement, ChanceSupportsNothing) {
  Agreement agreement(halves());
  agreement.remember({candidate(100, 8)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15);
  agreement.remember({candidate(100, 3)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15);
  agreement.remember({candidate(100, 9)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15.5);
}

TEST(Agreement, OnlyNearbyCandidatesSupport) {
  for (const std::ptrdiff_t near : {97, 103}) {
    Agreement agreement(halves());
    agreement.remember({candidate(near, 18)});
    EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 20) << near;
  }
  for (const std::ptrdiff_t far : {0, 96, 104, 500}) {
    Agreement agreement(halves());
    agreement.remember({candidate(far, 18)});
    EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15) << far;
  }
}

TEST(Agreement, BestNeighbourOfAStepSupportsAlone) {
  Agreement agreement(halves());
  agreement.remember({candidate(99, 12), candidate(101, 18), candidate(102, 10), candidate(7, 99)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 20);
}

TEST(Agreement, StepWithoutTheCandidateEndsItsSupport) {
  Agreement agreement(halves());
  agreement.remember({candidate(100, 28)});
  agreement.remember({candidate(7, 28)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15);
}

TEST(Agreement, StepWithoutEvidenceHandsSupportOn) {
  Agreement agreement(halves());
  agreement.remember({candidate(99, 48)});
  agreement.remember({candidate(101, 0), candidate(7, 8)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15 + 0.5 * 20);
}

TEST(Agreement, EvidenceForOnePlaceEndsTheWaysToOthers) {
  Agreement agreement(halves());
  agreement.remember({candidate(97, 48)});
  agreement.remember({candidate(95, 28), candidate(99, 8), candidate(101, 0)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15);
  EXPECT_DOUBLE_EQ(agreement.score(candidate(96, 15), true), 15 + 0.5 * (20 + 20));
}

TEST(Agreement, WithoutWeightTheScoreIsTheEvidence) {
  Agreement agreement({.agreement_weight = 0});
  agreement.remember({candidate(100, 50)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15);
}

TEST(Agreement, WithoutInliersThereIsNoScore) {
  Agreement agreement(halves());
  agreement.remember({candidate(100, 50)});
  EXPECT_DOUBLE_EQ(agreement.score(candidate(100, 0), true), 0);
}

using Places = std::vector<PlaceId>;

TEST(Agreement, FollowsTheWaysWithMostSupport) {
  DecisionOptions options = halves();
  options.followed_ways = 2;
  Agreement agreement(options);
  EXPECT_EQ(agreement.followed_places(), Places{});
  agreement.remember({candidate(10, 20), candidate(30, 40), candidate(33, 38), candidate(50, 28),
                      candidate(70, 8)});
  EXPECT_EQ(agreement.followed_places(), (Places{7 * 30, 7 * 50}));
  options.followed_ways = 0;
  Agreement none(options);
  none.remember({candidate(30, 40)});
  EXPECT_EQ(none.followed_places(), Places{});
}

TEST(Agreement, FollowsAWayUntilItsSupportHasFaded) {
  Agreement agreement(halves());
  agreement.remember({candidate(10, 24)});
  for (const int step : {11, 12, 13, 14}) {
    agreement.remember({candidate(step, 3), candidate(40, 7)});
    EXPECT_EQ(agreement.followed_places(), Places{7 * step});  // support 8, 4, 2, 1
  }
  agreement.remember({candidate(15, 3)});
  EXPECT_EQ(agreement.followed_places(), Places{});
}

TEST(Agreement, FollowsNoWayThatIsNotGoneOn) {
  Agreement agreement(halves());
  agreement.remember({candidate(10, 48)});
  agreement.remember({candidate(20, 3)});
  EXPECT_EQ(agreement.followed_places(), Places{});
}

TEST(InlierWorth, GrowsWithTheShareUpToTheFullOne) {
  const DecisionOptions options{.full_share = 0.2};
  EXPECT_DOUBLE_EQ(inlier_worth(0.0, {1000}, options), 0);
  EXPECT_DOUBLE_EQ(inlier_worth(0.05, {1000}, options), 0.5);
  EXPECT_DOUBLE_EQ(inlier_worth(0.2, {1000}, options), 1);
  EXPECT_DOUBLE_EQ(inlier_worth(0.9, {1000}, options), 1);
  EXPECT_DOUBLE_EQ(inlier_worth(0.0, {1000}, {.full_share = 0}), 1) << "switched off";
}

TEST(InlierWorth, FallsWithWhatTheViewSharesWithTheStepBefore) {
  const DecisionOptions options{.full_view_inliers = 30};
  EXPECT_DOUBLE_EQ(inlier_worth(1, {1000, 0}, options), 1);
  EXPECT_DOUBLE_EQ(inlier_worth(1, {1000, 30}, options), 1);
  EXPECT_DOUBLE_EQ(inlier_worth(1, {1000, 40}, options), 0.75);
  EXPECT_DOUBLE_EQ(inlier_worth(1, {1000, 60}, options), 0.5);
  EXPECT_DOUBLE_EQ(inlier_worth(1, {1000, 120}, options), 0.5);
  EXPECT_DOUBLE_EQ(inlier_worth(1, {1000, 600}, {.full_view_inliers = 600}), 1) << "switched off";
}

TEST(InlierWorth, GrowsWithTheMapUpToTheFullOne) {
  const DecisionOptions options{.full_steps = 99};
  EXPECT_DOUBLE_EQ(inlier_worth(1, {0}, options), 0);
  EXPECT_DOUBLE_EQ(inlier_worth(1, {9}, options), 0.5);
  EXPECT_DOUBLE_EQ(inlier_worth(1, {99}, options), 1);
  EXPECT_DOUBLE_EQ(inlier_worth(1, {100'000}, options), 1);
  EXPECT_DOUBLE_EQ(inlier_worth(1, {1}, {.full_steps = 1}), 1) << "switched off";
}

}  // namespace
}  // namespace loopbit::test
