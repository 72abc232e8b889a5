// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "place_filter.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace loopbit::test {
namespace {

constexpr std::ptrdiff_t kSteps = 5000;
constexpr std::size_t kSimilar = 16;

/// What a frame finds at some steps.
struct Found {
  int votes = 0;
  int inliers = -1;  ///< -1: it was not looked at closer
};
using FoundAt = std::map<std::ptrdiff_t, Found>;

VerifiedCandidate candidate(std::ptrdiff_t step, Found found) {
  VerifiedCandidate c{
      .candidate = {static_cast<PlaceId>(step), 0.5}, .step = step, .votes = found.votes};
  if (found.inliers >= 0) {
    c.geometry = CandidateGeometry{
        .matches = 100, .inliers = found.inliers, .distinct_inliers = found.inliers};
  }
  return c;
}

/// A filter that knows the map from `warm_up` new places, and a robot whose frames look like
/// sixteen paths all over the map: each has a few votes by chance and no inliers.
struct Robot {
  explicit Robot(int warm_up = 40) {
    for (int i = 0; i < warm_up; ++i) see({});
  }

  PlaceFilter filter;
  KnownLoops loops;
  std::function<bool(std::ptrdiff_t)> may_be_at = [](std::ptrdiff_t) { return true; };
  std::size_t num_similar = kSimilar;
  int frame = 0;

  [[nodiscard]] std::vector<VerifiedCandidate> candidates(const FoundAt& found) const {
    std::vector<VerifiedCandidate> all;
    std::mt19937 random(static_cast<std::uint32_t>(frame) + 1);
    for (std::size_t i = 0; i < num_similar; ++i) {
      const auto step = 1000 + 200 * static_cast<std::ptrdiff_t>(i) + frame;
      all.push_back(candidate(step, {2 + static_cast<int>(random() % 5)}));
    }
    for (const auto& [step, at] : found) all.push_back(candidate(step, at));
    return all;
  }

  [[nodiscard]] PlaceFilter::Update look(const FoundAt& found, bool is_step = true) const {
    return filter.update(filter.predict(is_step), candidates(found), num_similar, kSteps, loops,
                         may_be_at);
  }

  PlaceFilter::Update see(const FoundAt& found, bool is_step = true) {
    const PlaceFilter::Update update = look(found, is_step);
    filter.commit(filter.prepare(update, is_step, loops));
    ++frame;
    return update;
  }

  /// Frames at `first`, `first + speed`, ...
  PlaceFilter::Update follow(std::ptrdiff_t first, std::ptrdiff_t speed, int frames, Found found) {
    PlaceFilter::Update update;
    for (int i = 0; i < frames; ++i) update = see({{first + speed * i, found}});
    return update;
  }
};

constexpr Found kByNight{.votes = 22};
constexpr Found kByDay{.votes = 40, .inliers = 40};

std::ptrdiff_t matched_step(const PlaceFilter::Update& update) {
  return update.match ? update.observed[*update.match].step : -1;
}

double mass(const PlaceFilter::Belief& belief) {
  double sum = 0;
  for (const auto& h : belief.places) {
    EXPECT_GE(h.forward, 0);
    EXPECT_GE(h.backward, 0);
    sum += h.probability();
  }
  return sum;
}

TEST(PlaceFilter, APathIsFollowedForwardBackwardAndAtTwoStepsPerStep) {
  for (const std::ptrdiff_t speed : {1, 2, -1, -2}) {
    Robot robot;
    const double first = robot.see({{100, kByNight}}).probability;
    EXPECT_LT(first, 0.5) << "one such frame may be chance";
    const auto update = robot.follow(100 + speed, speed, 15, kByNight);
    EXPECT_GT(update.probability, 0.98) << speed;
    EXPECT_EQ(matched_step(update), 100 + 15 * speed);
    double forward = 0;
    double backward = 0;
    for (const auto& h : update.belief.places) {
      forward += h.forward;
      backward += h.backward;
    }
    EXPECT_GT(speed > 0 ? forward : backward, 0.9) << speed;
  }
}

TEST(PlaceFilter, FramesThatJumpAreNoPath) {
  Robot robot;
  for (int i = 0; i < 16; ++i) {
    EXPECT_LT(robot.see({{20 + 47 * (i * 7 % 16), kByNight}}).probability, 0.5) << i;
  }
}

TEST(PlaceFilter, InliersNeedNoPath) {
  Robot robot;
  const auto update = robot.see({{100, {.votes = 40, .inliers = 60}}});
  EXPECT_GT(update.probability, 0.98);
  EXPECT_EQ(matched_step(update), 100);
  EXPECT_GT(update.observed[*update.match].terms.geometry, 5);
}

TEST(PlaceFilter, ChanceInliersAreNoEvidence) {
  const Robot robot;
  const auto update = robot.look({{100, {.votes = 4, .inliers = 8}}});
  EXPECT_EQ(update.observed.back().step, 100);
  EXPECT_EQ(update.observed.back().terms.geometry, 0);
}

TEST(PlaceFilter, StandingStillAddsNothing) {
  Robot robot;
  robot.follow(100, 1, 4, kByNight);
  const FoundAt found{{104, kByNight}};
  const double moving = robot.look(found).probability;
  ASSERT_GT(moving, 0.01);
  ASSERT_LT(moving, 0.999);
  robot.filter.commit(robot.filter.prepare(robot.look(found), true, robot.loops));
  // The same frame again and again: only what has been learned of other places changes its answer.
  const double once = robot.look(found, false).probability;
  EXPECT_LE(once, moving);
  EXPECT_GT(once, 0.01);
  for (int i = 0; i < 10; ++i) {
    robot.filter.commit(robot.filter.prepare(robot.look(found, false), false, robot.loops));
    EXPECT_EQ(robot.look(found, false).probability, once) << i;
  }
}

TEST(PlaceFilter, LeavesAPathAndReturns) {
  Robot robot;
  EXPECT_GT(robot.follow(100, 1, 15, kByNight).revisit, 0.98);
  PlaceFilter::Update update;
  // Wherever the path may go on, there is no more than elsewhere.
  for (int i = 0; i < 20; ++i) {
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

/// Ten steps along 100 and along another path with the same votes.
PlaceFilter::Update with_rival(Robot& robot, std::ptrdiff_t rival) {
  PlaceFilter::Update update;
  for (int i = 0; i < 15; ++i) {
    update = robot.see({{100 + i, kByNight}, {rival + i, kByNight}});
  }
  return update;
}

TEST(PlaceFilter, ARivalElsewhereSharesTheProbability) {
  Robot robot;
  const auto update = with_rival(robot, 200);
  EXPECT_NEAR(update.probability, 0.5, 0.05);
  EXPECT_GT(update.revisit, 0.95) << "but the robot is back at one of them";
}

TEST(PlaceFilter, LapsThroughOnePlaceAreNoRivals) {
  Robot robot;
  for (std::ptrdiff_t step = 200; step < 220; ++step) robot.loops.add(step, step - 100);
  EXPECT_GT(with_rival(robot, 200).probability, 0.95);
}

TEST(PlaceFilter, EqualVotesEverywhereAreNoEvidence) {
  Robot robot;
  for (int i = 0; i < 30; ++i) {
    // As many as others have, or a little more.
    const auto update = robot.see({{100 + i, {.votes = 4 + i % 2}}});
    EXPECT_LT(update.revisit, 0.05) << i;
  }
}

TEST(PlaceFilter, TooFewCandidatesTellNothingOfVotes) {
  Robot few;
  few.num_similar = 7;
  const auto none = few.follow(100, 1, 15, {.votes = 60});
  EXPECT_FALSE(none.has_null);
  for (const auto& o : none.observed) EXPECT_EQ(o.terms.votes, 0);
  EXPECT_LT(none.revisit, 0.01);
  Robot enough;
  enough.num_similar = 8;
  const auto some = enough.follow(100, 1, 15, {.votes = 60});
  EXPECT_TRUE(some.has_null);
  EXPECT_GT(some.revisit, 0.5);
}

TEST(PlaceFilter, MapsFullOfLookAlikesDemandMoreInliers) {
  const FoundAt found{{100, {.votes = 4, .inliers = 25}}};
  Robot robot;
  const double before = robot.look(found).observed.back().terms.geometry;
  for (int i = 0; i < 60; ++i) robot.see({{130 + 13 * (i * 7 % 60), {.votes = 4, .inliers = 14}}});
  const double after = robot.look(found).observed.back().terms.geometry;
  EXPECT_GT(before, 0);
  EXPECT_LT(after, before - 1);
  // And where wrong places never have more than chance, fewer will do.
  Robot clear;
  for (int i = 0; i < 60; ++i) clear.see({{130 + 13 * (i * 7 % 60), {.votes = 4, .inliers = 6}}});
  EXPECT_GT(clear.look(found).observed.back().terms.geometry, before);
}

TEST(PlaceFilter, GeometryOfASmallMapSaysLess) {
  const Robot robot;
  const auto term_among = [&](std::ptrdiff_t steps) {
    return robot.filter
        .update({}, {candidate(5, {.votes = 40, .inliers = 40})}, 1, steps, {}, robot.may_be_at)
        .observed.front()
        .terms.geometry;
  };
  EXPECT_LT(term_among(5), term_among(20));
  EXPECT_LT(term_among(20), term_among(200));
}

TEST(PlaceFilter, WithdrawForgetsThePathAndItsLaps) {
  Robot robot;
  for (std::ptrdiff_t step = 200; step < 220; ++step) robot.loops.add(step, step - 100);
  with_rival(robot, 200);
  ASSERT_GT(1 - robot.filter.predict(true).elsewhere(), 0.9);
  robot.filter.withdraw(800, robot.loops);
  EXPECT_GT(1 - robot.filter.predict(true).elsewhere(), 0.9) << "that was elsewhere";
  robot.filter.withdraw(114, robot.loops);
  for (const bool is_step : {true, false}) {
    const auto left = robot.filter.predict(is_step);
    for (const auto& h : left.places) {
      EXPECT_GT(std::abs(h.step - 114), 10) << h.step;
      EXPECT_GT(std::abs(h.step - 214), 3) << h.step;
    }
    EXPECT_LT(mass(left), 0.05);
  }
}

TEST(PlaceFilter, ExcludedStepsHaveNoProbability) {
  Robot robot;
  robot.follow(100, 1, 12, kByDay);
  robot.may_be_at = [](std::ptrdiff_t step) { return step > 150; };
  // The path leads to where the robot may not be, and nothing else was found.
  const auto update = robot.see({});
  for (const auto& h : update.belief.places) EXPECT_GT(h.step, 150);
  EXPECT_LT(update.revisit, 0.05);
}

TEST(PlaceFilter, ProbabilitiesSumToAtMostOne) {
  Robot robot;
  const auto check = [&](const PlaceFilter::Update& update) {
    EXPECT_LE(mass(update.prior), 1 + 1e-9);
    EXPECT_LE(mass(update.belief), 1 + 1e-9);
    EXPECT_LE(update.probability, update.revisit + 1e-9);
    EXPECT_NEAR(update.revisit, mass(update.belief), 1e-9);
    EXPECT_TRUE(std::ranges::is_sorted(update.belief.places, {}, &PlaceFilter::Hypothesis::step));
  };
  for (int i = 0; i < 20; ++i) check(robot.see({{100 + i, kByDay}, {200 - i, kByDay}}));
  for (std::ptrdiff_t step = 200; step < 220; ++step) robot.loops.add(step, step - 100);
  for (int i = 0; i < 20; ++i) check(robot.see({{100 + i, kByDay}, {200 + i, kByNight}}));
}

TEST(PlaceFilter, PrepareChangesNoAnswerBeforeCommit) {
  Robot robot;
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

TEST(PlaceFilter, LikeliestAreDifferentPathsInOrder) {
  const PlaceFilter::Belief belief{{{10, 0.2, 0}, {14, 0.1, 0.05}, {40, 0, 0.3}, {90, 0.001, 0}}};
  EXPECT_EQ(PlaceFilter::likeliest(belief, 0.01, 5), (std::vector<std::ptrdiff_t>{40, 10}));
  EXPECT_EQ(PlaceFilter::likeliest(belief, 0.0, 5), (std::vector<std::ptrdiff_t>{40, 10, 90}));
  EXPECT_EQ(PlaceFilter::likeliest(belief, 0.0, 1), (std::vector<std::ptrdiff_t>{40}));
}

}  // namespace
}  // namespace loopbit::test
