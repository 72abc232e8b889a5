// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "agreement.hpp"

#include <cstddef>

#include <gtest/gtest.h>

namespace loopbit::test {
namespace {

/// Two steps support, at half weight; 8 inliers are chance.
DecisionOptions two_steps() {
  return {.agreement_steps = 2, .agreement_weight = 0.5, .chance_inliers = 8};
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

TEST(Agreement, ScoreOfTheFirstFrameIsItsInliers) {
  EXPECT_DOUBLE_EQ(score_of_next_step(Agreement(two_steps())), 15);
  EXPECT_DOUBLE_EQ(Agreement(two_steps()).score(candidate(100, 15), false), 15);
}

TEST(Agreement, StepsBeforeAddTheirInliersBeyondChance) {
  Agreement agreement(two_steps());
  agreement.remember({candidate(98, 18)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15 + 0.5 * 10);
  agreement.remember({candidate(99, 28)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15 + 0.5 * (10 + 20));
}

TEST(Agreement, FrameThatShowsTheLastStepAgainIsNotSupportedByIt) {
  Agreement agreement(two_steps());
  agreement.remember({candidate(98, 18)});
  EXPECT_DOUBLE_EQ(agreement.score(candidate(100, 15), false), 15);
  agreement.remember({candidate(99, 28)});
  EXPECT_DOUBLE_EQ(agreement.score(candidate(100, 15), false), 15 + 0.5 * 10);
}

TEST(Agreement, StandingStillKeepsTheScore) {
  Agreement agreement(two_steps());
  agreement.remember({candidate(97, 12)});
  agreement.remember({candidate(98, 18)});
  const double moving = score_of_next_step(agreement);
  agreement.remember({candidate(100, 15)});
  EXPECT_DOUBLE_EQ(agreement.score(candidate(100, 15), false), moving);
}

TEST(Agreement, ChanceInliersSupportNothing) {
  Agreement agreement(two_steps());
  agreement.remember({candidate(100, 8)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15);
  agreement.remember({candidate(100, 3)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15);
  agreement.remember({candidate(100, 9)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15.5);
}

TEST(Agreement, OnlyNearbyCandidatesSupport) {
  for (const std::ptrdiff_t near : {97, 103}) {
    Agreement agreement(two_steps());
    agreement.remember({candidate(near, 18)});
    EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 20) << near;
  }
  for (const std::ptrdiff_t far : {0, 96, 104, 500}) {
    Agreement agreement(two_steps());
    agreement.remember({candidate(far, 18)});
    EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15) << far;
  }
}

TEST(Agreement, TheStepBeforeTheLastMayBeTwiceAsFar) {
  for (const std::ptrdiff_t near : {94, 106}) {
    Agreement agreement(two_steps());
    agreement.remember({candidate(near, 18)});
    agreement.remember({});
    EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 20) << near;
  }
  Agreement agreement(two_steps());
  agreement.remember({candidate(93, 18)});
  agreement.remember({});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15);
}

TEST(Agreement, BestNeighbourOfAStepSupportsAlone) {
  Agreement agreement(two_steps());
  agreement.remember({candidate(99, 12), candidate(101, 18), candidate(102, 10), candidate(7, 99)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 20);
}

TEST(Agreement, FadesAfterItsSteps) {
  Agreement agreement(two_steps());
  agreement.remember({candidate(100, 28)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 25);
  agreement.remember({});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 25);
  agreement.remember({});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15);
  EXPECT_DOUBLE_EQ(agreement.score(candidate(100, 15), false), 25) << "two before the last step";
}

TEST(Agreement, WithoutStepsTheScoreIsTheInliers) {
  Agreement agreement({.agreement_steps = 0});
  agreement.remember({candidate(100, 50)});
  EXPECT_DOUBLE_EQ(score_of_next_step(agreement), 15);
  EXPECT_DOUBLE_EQ(agreement.score(candidate(100, 15), false), 15);
}

TEST(Agreement, WithoutInliersThereIsNoScore) {
  Agreement agreement(two_steps());
  agreement.remember({candidate(100, 50)});
  EXPECT_DOUBLE_EQ(agreement.score(candidate(100, 0), true), 0);
}

}  // namespace
}  // namespace loopbit::test
