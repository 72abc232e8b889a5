// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "place_filter.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "filter_robot.hpp"

namespace loopbit::test {
namespace {

std::ptrdiff_t matched_step(const PlaceFilter::Update& update) {
  return update.match ? update.observed[*update.match].step : -1;
}

double mass(const Belief& belief) {
  double sum = 0;
  for (const auto& h : belief.places) {
    for (const double probability : h.by_motion) EXPECT_GE(probability, 0);
    sum += h.probability();
  }
  return sum;
}

TEST(PlaceFilter, APathIsFollowedForwardBackwardAndAtTwoStepsPerStep) {
  // Moves of two steps are half as likely, so that each frame has to say more.
  constexpr Found kAtDusk{.votes = 30};
  for (const std::ptrdiff_t speed : {1, 2, -1, -2}) {
    const Found found = speed == 1 || speed == -1 ? kByNight : kAtDusk;
    FilterRobot robot;
    const double first = robot.see({{100, found}}).probability;
    EXPECT_LT(first, 0.5) << "one such frame may be chance";
    const auto update = robot.follow(100 + speed, speed, 15, found);
    EXPECT_GT(update.probability, 0.98) << speed;
    EXPECT_EQ(matched_step(update), 100 + 15 * speed);
    const std::size_t motion = speed > 0 ? 0 : kNumPaces;
    double right_way = 0;
    for (const auto& h : update.belief.places) {
      right_way += std::accumulate(&h.by_motion[motion], &h.by_motion[motion] + kNumPaces, 0.0);
    }
    EXPECT_GT(right_way, 0.9) << speed;
  }
}

TEST(PlaceFilter, APathIsFollowedAtHalfThePaceAndAtThreeTimes) {
  constexpr Found kAtDusk{.votes = 30};
  FilterRobot fast;
  EXPECT_GT(fast.follow(100, 3, 20, kAtDusk).probability, 0.98);
  FilterRobot slow;
  PlaceFilter::Update update;
  for (int i = 0; i < 30; ++i) update = slow.see({{100 + i / 2, {.votes = 16}}});
  EXPECT_GT(update.probability, 0.98);
}

TEST(PlaceFilter, WhatPlacesJustLeftShowIsNoEvidence) {
  FilterRobot corridor;
  corridor.votes_just_left = {20, 24};
  EXPECT_LT(corridor.follow(100, 1, 30, kByNight).probability, 0.5);
  FilterRobot revisit;
  revisit.votes_just_left = {20, 24};
  EXPECT_GT(revisit.follow(100, 1, 15, {.votes = 90}).probability, 0.98) << "more than that";
}

TEST(PlaceFilter, SurroundingsChangeWithinAFewSteps) {
  FilterRobot robot;
  const auto sigmas = [&] { return robot.look({{100, kByNight}}).observed.back().sigmas; };
  const double at_first = sigmas();
  robot.votes_just_left = {20, 24};
  for (int i = 0; i < 12; ++i) robot.see({});
  EXPECT_LT(sigmas(), 0.3 * at_first);
  robot.votes_just_left = {3, 5};
  for (int i = 0; i < 12; ++i) robot.see({});
  EXPECT_GT(sigmas(), 0.9 * at_first);
}

TEST(PlaceFilter, PlacesJustLeftThatShowLessThanChanceSayNothing) {
  FilterRobot robot;
  FilterRobot same;
  same.votes_just_left = {2, 3};
  EXPECT_DOUBLE_EQ(robot.follow(100, 1, 5, kByNight).probability,
                   same.follow(100, 1, 5, kByNight).probability);
}

TEST(PlaceFilter, VotesCountMoreWhereTheDisplacementIsSteady) {
  FilterRobot steady;
  FilterRobot jumping;
  PlaceFilter::Update with;
  PlaceFilter::Update without;
  for (int i = 0; i < 6; ++i) {
    const auto square = Displacements::moved(0, 20, 20);
    const auto other = Displacements::moved(square, 5 * (i % 2), 0);
    with = steady.see({{100 + i, {.votes = 10, .square = square}}});
    without = jumping.see({{100 + i, {.votes = 10, .square = other}}});
  }
  EXPECT_DOUBLE_EQ(with.observed.back().sigmas, without.observed.back().sigmas);
  EXPECT_GT(with.observed.back().votes, without.observed.back().votes + 0.5);
  EXPECT_GT(with.probability, without.probability);
}

/// How probable a path is after `steps` that look somewhat like it, on a map where streets look
/// like others for as long as they last, or from step to step by chance.
double probability_after(int steps, bool streets_last) {
  FilterRobot robot(0);
  std::mt19937 random(5);
  for (int i = 0; i < 120; ++i) {
    FoundAt streets;
    for (int street = 0; street < 8; ++street) {
      const unsigned percent = !streets_last ? 50 : street % 2 == 0 ? 85 : 15;
      const bool looks_alike = random() % 100 < percent;
      streets[8000 + 300 * street + i] = {.votes = looks_alike ? 8 : 1};
    }
    robot.see(streets);
  }
  return robot.follow(100, 1, steps, {.votes = 12}).probability;
}

TEST(PlaceFilter, AStreetThatLooksLikeAnotherForLongIsNoLoop) {
  // As when a camera takes thirty images a second: the same street has ten times as many steps.
  EXPECT_GT(probability_after(45, false), 0.98);
  EXPECT_LT(probability_after(45, true), 0.5);
}

TEST(PlaceFilter, FramesThatJumpAreNoPath) {
  FilterRobot robot;
  for (int i = 0; i < 16; ++i) {
    EXPECT_LT(robot.see({{20 + 47 * (i * 7 % 16), kByNight}}).probability, 0.5) << i;
  }
}

TEST(PlaceFilter, InliersNeedNoPath) {
  FilterRobot robot;
  const auto update = robot.see({{100, {.votes = 40, .inliers = 60}}});
  EXPECT_GT(update.probability, 0.98);
  EXPECT_EQ(matched_step(update), 100);
  EXPECT_GT(update.observed[*update.match].geometry, 5);
}

TEST(PlaceFilter, ChanceInliersAreNoEvidence) {
  const FilterRobot robot;
  const auto update = robot.look({{100, {.votes = 4, .inliers = 8}}});
  EXPECT_EQ(update.observed.back().step, 100);
  EXPECT_EQ(update.observed.back().geometry, 0);
}

TEST(PlaceFilter, StandingStillAddsNothing) {
  FilterRobot robot;
  robot.follow(100, 1, 5, kByNight);
  const FoundAt found{{105, kByNight}};
  const double moving = robot.look(found).probability;
  ASSERT_GT(moving, 0.005);
  ASSERT_LT(moving, 0.999);
  robot.filter.commit(robot.filter.prepare(robot.look(found), true, robot.loops));
  // The same frame again and again: only what has been learned of other places changes its answer.
  const double once = robot.look(found, false).probability;
  EXPECT_LE(once, moving);
  EXPECT_GT(once, 0.005);
  for (int i = 0; i < 10; ++i) {
    robot.filter.commit(robot.filter.prepare(robot.look(found, false), false, robot.loops));
    EXPECT_EQ(robot.look(found, false).probability, once) << i;
  }
}

TEST(PlaceFilter, LeavesAPathAndReturns) {
  FilterRobot robot;
  EXPECT_GT(robot.follow(100, 1, 15, kByNight).revisit, 0.98);
  PlaceFilter::Update update;
  // Wherever the path may go on, there is no more than elsewhere.
  for (int i = 0; i < 30; ++i) {
    FoundAt found;
    for (const auto step : PlaceFilter::likeliest(robot.filter.predict(true), 1e-4, 3)) {
      for (int beside = -2; beside <= 2; ++beside) found[step + beside] = {.votes = 3};
    }
    update = robot.see(found);
  }
  EXPECT_LT(update.revisit, 0.1);
  update = robot.follow(200, 1, 15, kByNight);
  EXPECT_GT(update.probability, 0.98);
  EXPECT_EQ(matched_step(update), 214);
}

TEST(PlaceFilter, APathThatLastedIsLeftMoreSeldomUntilItEnds) {
  FilterRobot robot;
  robot.follow(100, 1, 15, kByNight);
  const double early = robot.filter.predict(true).leave;
  robot.follow(115, 1, 100, kByNight);
  const double late = robot.filter.predict(true).leave;
  EXPECT_LT(late, 0.6 * early);
  robot.filter.withdraw(214, robot.loops);
  robot.see({});
  EXPECT_GT(robot.filter.predict(true).leave, late);
}

/// Ten steps along 100 and along another path with the same votes.
PlaceFilter::Update with_rival(FilterRobot& robot, std::ptrdiff_t rival) {
  PlaceFilter::Update update;
  for (int i = 0; i < 15; ++i) {
    update = robot.see({{100 + i, kByNight}, {rival + i, kByNight}});
  }
  return update;
}

TEST(PlaceFilter, ARivalElsewhereSharesTheProbability) {
  FilterRobot robot;
  const auto update = with_rival(robot, 200);
  EXPECT_NEAR(update.probability, 0.5, 0.05);
  EXPECT_GT(update.revisit, 0.95) << "but the robot is back at one of them";
}

TEST(PlaceFilter, LapsThroughOnePlaceAreNoRivals) {
  FilterRobot robot;
  for (std::ptrdiff_t step = 200; step < 220; ++step) robot.loops.add(step, step - 100);
  EXPECT_GT(with_rival(robot, 200).probability, 0.95);
}

TEST(PlaceFilter, EqualVotesEverywhereAreNoEvidence) {
  FilterRobot robot;
  for (int i = 0; i < 30; ++i) {
    // As many as others have, or a little more.
    const auto update = robot.see({{100 + i, {.votes = 4 + i % 2}}});
    EXPECT_LT(update.revisit, 0.05) << i;
  }
}

TEST(PlaceFilter, TooFewCandidatesTellNothingOfVotes) {
  FilterRobot few;
  few.num_similar = 7;
  const auto none = few.follow(100, 1, 15, {.votes = 60});
  EXPECT_FALSE(none.has_null);
  for (const auto& o : none.observed) EXPECT_EQ(o.votes, 0);
  EXPECT_LT(none.revisit, 0.01);
  FilterRobot enough;
  enough.num_similar = 8;
  const auto some = enough.follow(100, 1, 15, {.votes = 60});
  EXPECT_TRUE(some.has_null);
  EXPECT_GT(some.revisit, 0.5);
}

TEST(PlaceFilter, PlacesThatCannotMatchShowWhatWrongOnesHave) {
  FilterRobot all;
  FilterRobot few;
  few.may_match = [](std::ptrdiff_t step) { return step < 1000; };
  const auto expected = all.follow(100, 1, 15, kByNight);
  const auto update = few.follow(100, 1, 15, kByNight);
  EXPECT_TRUE(update.has_null);
  EXPECT_NEAR(update.observed.back().votes, expected.observed.back().votes, 0.5);
  EXPECT_GT(update.probability, 0.98);
}

TEST(PlaceFilter, APlaceThatCannotMatchDoesNot) {
  FilterRobot robot;
  robot.may_match = [](std::ptrdiff_t step) { return step < 1000; };
  const auto update = robot.look({{100, {.votes = 4}}, {2000, {.votes = 60}}});
  EXPECT_EQ(matched_step(update), 100);
  EXPECT_LT(update.revisit, 0.01);
  robot.may_match = [](std::ptrdiff_t) { return false; };
  EXPECT_FALSE(robot.look({{100, kByDay}}).match);
}

TEST(PlaceFilter, AStoreyThatCannotMatchSaysNothingOfPaths) {
  FilterRobot robot;
  robot.may_match = [](std::ptrdiff_t step) { return step < 500; };
  FilterRobot without;
  without.may_match = robot.may_match;
  for (int i = 0; i < 40; ++i) {
    robot.see({{500 + i, {.votes = 40}}});
    without.see({});
  }
  const FoundAt found{{100, kByNight}};
  const double votes = without.look(found).observed.back().votes;
  EXPECT_GT(votes, 2);
  EXPECT_NEAR(robot.look(found).observed.back().votes, votes, 0.5);
}

TEST(PlaceFilter, MapsFullOfLookAlikesDemandMoreInliers) {
  const FoundAt found{{100, {.votes = 4, .inliers = 25}}};
  FilterRobot robot;
  const double before = robot.look(found).observed.back().geometry;
  for (int i = 0; i < 60; ++i) robot.see({{130 + 13 * (i * 7 % 60), {.votes = 4, .inliers = 14}}});
  const double after = robot.look(found).observed.back().geometry;
  EXPECT_GT(before, 0);
  EXPECT_LT(after, before - 1);
  // And where wrong places never have more than chance, fewer will do.
  FilterRobot clear;
  for (int i = 0; i < 60; ++i) clear.see({{130 + 13 * (i * 7 % 60), {.votes = 4, .inliers = 6}}});
  EXPECT_GT(clear.look(found).observed.back().geometry, before);
}

TEST(PlaceFilter, OdometryTellsTwinsApart) {
  const FoundAt twins{{100, {.votes = 30, .inliers = 60}}, {900, {.votes = 33, .inliers = 70}}};
  FilterRobot robot;
  EXPECT_LT(robot.look(twins).probability, robot.min_score);
  robot.return_weight = [](std::ptrdiff_t step) { return step == 900 ? 1e-4 : 1.0; };
  const PlaceFilter::Update update = robot.look(twins);
  ASSERT_TRUE(update.match);
  EXPECT_EQ(update.observed[*update.match].step, 100);
  EXPECT_GE(update.probability, robot.min_score);
}

TEST(PlaceFilter, OdometryTellsWhichStepComesNext) {
  // The robot stops and goes, and sees too little to be sure of where it is.
  const auto drive = [](bool with_odometry) {
    constexpr Found kLittle{.votes = 16};
    FilterRobot robot;
    std::ptrdiff_t step = 100;
    double sum = 0;
    for (int i = 0; i < 24; ++i) {
      const std::ptrdiff_t moved = i % 2 == 0 ? 0 : 4;
      if (with_odometry) {
        robot.agreement = [moved](std::ptrdiff_t /*step*/) {
          OfMoves agreement;
          agreement.fill(0.01);
          for (const std::ptrdiff_t by : {-moved, moved}) {
            agreement[static_cast<std::size_t>(kMaxMove + by)] = 1;
          }
          return agreement;
        };
      }
      step += moved;
      sum += robot.see({{step, kLittle}}).probability;
    }
    return sum / 24;
  };
  EXPECT_GT(drive(true), 0.4);
  EXPECT_LT(drive(false), 0.1);
}

TEST(PlaceFilter, GeometryOfASmallMapSaysLess) {
  const FilterRobot robot;
  const auto term_among = [&](std::ptrdiff_t steps) {
    return robot.filter
        .update({}, {candidate(5, {.votes = 40, .inliers = 40})}, 1,
                {steps, robot.may_be_at, robot.return_weight}, {})
        .observed.front()
        .geometry;
  };
  EXPECT_LT(term_among(5), term_among(20));
  EXPECT_LT(term_among(20), term_among(200));
}

TEST(PlaceFilter, WithdrawForgetsThePathAndItsLaps) {
  FilterRobot robot;
  for (std::ptrdiff_t step = 200; step < 220; ++step) robot.loops.add(step, step - 100);
  with_rival(robot, 200);
  ASSERT_GT(1 - robot.filter.predict(true).elsewhere(), 0.9);
  robot.filter.withdraw(800, robot.loops);
  EXPECT_GT(1 - robot.filter.predict(true).elsewhere(), 0.9) << "that was elsewhere";
  robot.filter.withdraw(114, robot.loops);
  for (const bool is_step : {true, false}) {
    const auto left = robot.filter.predict(is_step);
    for (const auto& h : left.places) {
      // Nearest are those that were just far enough away to be kept, and moved by four steps.
      EXPECT_GT(std::abs(h.step - 114), 8) << h.step;
      EXPECT_GT(std::abs(h.step - 214), 1) << h.step;
    }
    EXPECT_LT(mass(left), 0.05);
  }
}

double score_of(const ScoreTerms& terms) { return 1 / (1 + std::exp(-terms.sum())); }

TEST(PlaceFilter, TermsAddUpToTheLogOddsOfTheScore) {
  FilterRobot robot;
  robot.loops.add(400, 100);
  for (int i = 0; i < 30; ++i) {
    // A path with a rival at times, inliers at times, and frames that speak against it.
    FoundAt found{{100 + i, i % 7 == 5 ? Found{.votes = 0} : kByNight}};
    if (i % 5 == 4) found[2000] = {.votes = 20};
    if (i % 4 == 3) found[100 + i].inliers = 14;
    const auto update = robot.see(found);
    ASSERT_TRUE(update.match) << i;
    EXPECT_NEAR(score_of(update.terms), update.probability, 1e-8) << i;
    EXPECT_LE(update.terms.rivals, 0) << i;
    const auto& match = update.observed[*update.match];
    EXPECT_NEAR(update.terms.votes + update.terms.geometry, match.log_likelihood_ratio(), 1e-8);
    EXPECT_NEAR(update.terms.prior, std::log(0.01 / kSteps), 1e-8);
  }
}

TEST(PlaceFilter, TermsNameWhatSpeaksForAMatch) {
  FilterRobot alone;
  const auto by_inliers = alone.see({{100, {.votes = 4, .inliers = 60}}});
  EXPECT_GT(by_inliers.terms.geometry, 10);
  EXPECT_NEAR(by_inliers.terms.path, 0, 0.1) << "no frame before speaks for it";
  EXPECT_NEAR(by_inliers.terms.rivals, 0, 0.1);
  FilterRobot night;
  night.follow(100, 1, 12, kByNight);
  const auto by_path = night.see({{112, kByNight}});
  EXPECT_GT(by_path.terms.path, 5);
  EXPECT_EQ(by_path.terms.geometry, 0);
  const auto shared = FilterRobot().look({{100, kByDay}, {3000, kByDay}});
  EXPECT_LT(shared.terms.rivals, -1) << "another place shows as much";
}

TEST(PlaceFilter, ExcludedStepsHaveNoProbability) {
  FilterRobot robot;
  robot.follow(100, 1, 12, kByDay);
  robot.may_be_at = [](std::ptrdiff_t step) { return step > 150; };
  // The path leads to where the robot may not be, and nothing else was found.
  const auto update = robot.see({});
  for (const auto& h : update.belief.places) EXPECT_GT(h.step, 150);
  EXPECT_LT(update.revisit, 0.05);
}

TEST(PlaceFilter, ProbabilitiesSumToAtMostOne) {
  FilterRobot robot;
  const auto check = [&](const PlaceFilter::Update& update) {
    EXPECT_LE(mass(update.prior), 1 + 1e-9);
    EXPECT_LE(mass(update.belief), 1 + 1e-9);
    EXPECT_LE(update.probability, update.revisit + 1e-9);
    EXPECT_NEAR(update.revisit, mass(update.belief), 1e-9);
    EXPECT_TRUE(std::ranges::is_sorted(update.belief.places, {}, &Hypothesis::step));
  };
  for (int i = 0; i < 20; ++i) check(robot.see({{100 + i, kByDay}, {200 - i, kByDay}}));
  for (std::ptrdiff_t step = 200; step < 220; ++step) robot.loops.add(step, step - 100);
  for (int i = 0; i < 20; ++i) check(robot.see({{100 + i, kByDay}, {200 + i, kByNight}}));
}

TEST(PlaceFilter, PrepareChangesNoAnswerBeforeCommit) {
  FilterRobot robot;
  robot.follow(100, 1, 6, kByNight);
  const FoundAt found{{106, kByNight}, {700, {.votes = 5, .inliers = 16}}};
  const auto answers = [&] {
    std::vector<double> numbers;
    for (const bool is_step : {true, false}) {
      const auto update = robot.look(found, is_step);
      numbers.push_back(update.probability);
      numbers.push_back(update.revisit);
      for (const auto& o : update.observed) numbers.push_back(o.log_likelihood_ratio());
    }
    return numbers;
  };
  const auto before = answers();
  auto next = robot.filter.prepare(robot.look(found), true, robot.loops);
  EXPECT_EQ(answers(), before);
  robot.filter.commit(std::move(next));
  EXPECT_NE(answers(), before);
}

TEST(PlaceFilter, TheMatchSharesMostWithTheFrameAsFarAsItIsProbable) {
  const Belief belief{{{100, {0.5}}, {102, {0.3}}, {300, {0.1}}, {400, {0.1}}}};
  const auto seen = [](std::ptrdiff_t step, int votes) {
    return PlaceFilter::Observed{.candidate = {}, .step = step, .num_votes = votes};
  };
  // Times their probability: 10, 12, 0, 13, 20.
  const std::vector<PlaceFilter::Observed> observed{seen(100, 20), seen(102, 40), seen(108, 500),
                                                    seen(300, 130), seen(400, 200)};
  KnownLoops loops;
  const auto matched = [&] {
    const auto match = PlaceFilter::match_near(100, observed, belief, loops);
    return match ? observed[*match].step : -1;
  };
  EXPECT_EQ(matched(), 102) << "step 108 has most votes, but is not probable; 300 is elsewhere";
  loops.add(300, 100);
  EXPECT_EQ(matched(), 300) << "a lap through the same place";
}

TEST(PlaceFilter, TheMatchIsInTheViewThatVotesAndInliersPrefer) {
  const Belief belief{{{100, {0.5}}, {102, {0.3}}, {108, {0.01}}, {109, {0.02}}, {300, {0.1}}}};
  const auto seen = [](std::ptrdiff_t step, int votes, double geometry) {
    return PlaceFilter::Observed{
        .candidate = {}, .step = step, .num_votes = votes, .geometry = geometry};
  };
  const KnownLoops loops;
  const auto matched = [&](const PlaceFilter::Observed& other) {
    const std::vector<PlaceFilter::Observed> observed{seen(100, 20, 3), seen(102, 20, 0), other,
                                                      seen(109, 19, 0), seen(300, 90, 9)};
    const auto match = PlaceFilter::match_near(100, observed, belief, loops);
    return match ? observed[*match].step : -1;
  };
  EXPECT_EQ(matched(seen(108, 30, 2)), 100) << "its inliers say less";
  EXPECT_EQ(matched(seen(108, 19, 9)), 100) << "it has fewer votes; step 300 is another place";
  EXPECT_EQ(matched(seen(108, 20, 4)), 109) << "as close to the other view as a robot moves";
}

TEST(PlaceFilter, LikeliestAreDifferentPathsInOrder) {
  const Belief belief{{{10, {0.2}}, {14, {0.1, 0.05}}, {40, {0, 0.3}}, {90, {0.001}}}};
  EXPECT_EQ(PlaceFilter::likeliest(belief, 0.01, 5), (std::vector<std::ptrdiff_t>{40, 10}));
  EXPECT_EQ(PlaceFilter::likeliest(belief, 0.0, 5), (std::vector<std::ptrdiff_t>{40, 10, 90}));
  EXPECT_EQ(PlaceFilter::likeliest(belief, 0.0, 1), (std::vector<std::ptrdiff_t>{40}));
}

}  // namespace
}  // namespace loopbit::test
