// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "place_filter.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "evidence.hpp"

namespace loopbit::test {
namespace {

constexpr double kLeave = 0.001;

bool anywhere(std::ptrdiff_t /*step*/) { return true; }

double sum(const Beliefs& beliefs) {
  double mass = beliefs.elsewhere;
  for (const Belief& belief : beliefs.steps) mass += belief.mass();
  return mass;
}

/// Follows the evidence of `log_ratio` for one step after another.
Beliefs after_following(int first, int last, int way, double log_ratio, double share) {
  Beliefs beliefs;
  for (int step = first; step != last + way; step += way) {
    const std::vector<StepEvidence> evidence{{step, log_ratio}};
    beliefs = updated(entered(moved(beliefs, kLeave, anywhere), evidence, 100), evidence, share);
  }
  return beliefs;
}

TEST(PlaceFilter, BeginsSomewhereNew) {
  EXPECT_EQ(Beliefs{}.elsewhere, 1);
  EXPECT_EQ(moved({}, kLeave, anywhere).elsewhere, 1);
}

TEST(PlaceFilter, ProbabilitiesSumToOne) {
  const Beliefs beliefs = after_following(10, 20, 1, 2.0, 0.5);
  EXPECT_NEAR(sum(beliefs), 1, 1e-12);
  EXPECT_NEAR(sum(moved(beliefs, kLeave, anywhere)), 1, 1e-12);
}

TEST(PlaceFilter, IsBayesRule) {
  const Beliefs prior{{{3, 0.1, 0.1}, {8, 0.2, 0.0}}, 0.6};
  const Beliefs posterior = updated(prior, {{3, std::log(6.0)}, {8, std::log(2.0)}}, 1);
  EXPECT_NEAR(posterior.at(3), 1.2 / 2.2, 1e-12);
  EXPECT_NEAR(posterior.at(8), 0.4 / 2.2, 1e-12);
  EXPECT_NEAR(posterior.elsewhere, 0.6 / 2.2, 1e-12);
}

TEST(PlaceFilter, FollowsAPathEitherWay) {
  EXPECT_GT(after_following(10, 20, 1, 2.0, 1).at(20), 0.5);
  EXPECT_GT(after_following(20, 10, -1, 2.0, 1).at(10), 0.5);
}

TEST(PlaceFilter, OneFrameSaysLessThanAPath) {
  EXPECT_LT(after_following(10, 10, 1, 3.0, 1).at(10), 0.01);
  EXPECT_GT(after_following(10, 16, 1, 3.0, 1).at(16), 0.5);
}

TEST(PlaceFilter, WhatTheFrameBeforeShowedIsNoSecondWitness) {
  EXPECT_LT(after_following(10, 16, 1, 3.0, 0.1).at(16), after_following(10, 16, 1, 3.0, 1).at(16));
  const Beliefs prior{{{3, 0.1, 0.1}}, 0.8};
  EXPECT_EQ(updated(prior, {{3, 5.0}}, 0).at(3), prior.at(3));
}

TEST(PlaceFilter, RivalsShareTheProbability) {
  const Beliefs prior{{{3, 0.1, 0.0}, {60, 0.1, 0.0}}, 0.8};
  const Beliefs posterior = updated(prior, {{3, 9.0}, {60, 9.0}}, 1);
  EXPECT_EQ(posterior.at(3), posterior.at(60));
  EXPECT_LT(posterior.at(3), 0.5);
}

TEST(PlaceFilter, LeavesWhereThePathEnds) {
  const Beliefs beliefs{{{5, 1.0, 0.0}}, 0};
  const auto up_to_5 = [](std::ptrdiff_t step) { return step <= 5; };
  EXPECT_GT(moved(beliefs, kLeave, up_to_5).elsewhere, 0.5);
  EXPECT_EQ(only(beliefs, up_to_5).at(5), 1);
}

TEST(PlaceFilter, KeepsABoundedNumberOfSteps) {
  Beliefs beliefs{{}, 0};
  for (std::ptrdiff_t step = 0; step < 5000; ++step) beliefs.steps.push_back({10 * step, 2e-4, 0});
  EXPECT_LE(moved(beliefs, kLeave, anywhere).steps.size(), 256U);
}

TEST(Evidence, IsNeverBelowAHalfAndRisesWithTheValue) {
  const Null null{.middle = 5, .spread = 2, .freedom = 10};
  double before = -1;
  for (double value = -20; value < 200; value += 0.5) {
    const double ratio = log_likelihood_ratio(value, null);
    EXPECT_GE(ratio, std::log(0.5) - 1e-3);
    EXPECT_GE(ratio, before - 1e-3) << value;
    before = ratio;
  }
}

TEST(Evidence, MisleadsNoMoreThanChanceAllows) {
  // The mean of the ratio over the values that wrong places show, here normal ones.
  const Null null{.middle = 0, .spread = 1, .freedom = 1000};
  constexpr double kStep = 0.001;
  double mean = 0;
  for (double value = -8; value < 8; value += kStep) {
    const double density = std::exp(-value * value / 2) / std::sqrt(2 * std::acos(-1.0));
    mean += kStep * density * std::exp(log_likelihood_ratio(value, null));
  }
  EXPECT_NEAR(mean, 1, 0.15);
}

TEST(Evidence, ASmallMapSaysLess) {
  EXPECT_LT(log_likelihood_ratio(6, {0, 1, 3}), log_likelihood_ratio(6, {0, 1, 15}));
}

TEST(Evidence, GeometryCountsLessWhereWrongPlacesHaveItToo) {
  const auto place_with = [](std::size_t inliers) {
    LookedAt place;
    place.verification.emplace();
    place.verification->matches.resize(inliers);
    place.verification->inliers.resize(inliers);
    return place;
  };
  NullModel model;
  model.reserve_next(0);
  model.set_size(1);
  LookedAt before = place_with(30);
  model.weigh_geometry(before);
  for (int frame = 0; frame < 20; ++frame) {
    std::vector<LookedAt> places{place_with(30)};
    model.learn({}, places, [](const LookedAt&) { return 1.0; });
  }
  LookedAt after = place_with(30);
  model.weigh_geometry(after);
  EXPECT_GT(before.geometry_log_ratio, 3);
  EXPECT_LT(after.geometry_log_ratio, 1);
}

}  // namespace
}  // namespace loopbit::test
