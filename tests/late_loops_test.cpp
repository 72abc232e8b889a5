// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "late_loops.hpp"

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "filter_robot.hpp"

namespace loopbit::test {
namespace {

/// A frame of a path that alone is far from sure. A revisit becomes likelier than not with the 13th
/// of them, and sure with the 20th.
constexpr Found kWeak{.votes = 20};

/// Follows a path from step 100 with weak frames until the filter is sure; returns the frames that
/// were loops at once, and notes the late ones.
struct Walk {
  FilterRobot robot;
  std::set<int> at_once;
  std::map<int, LateLoops::Loop> late;
  std::map<int, LateLoops::Loop> withdrawn;

  void see(const FoundAt& found, bool is_step = true) {
    const int frame = robot.frame;
    const auto update = robot.see(found, is_step);
    if (update.match && update.probability >= robot.min_score) at_once.insert(frame);
    for (const auto& loop : robot.changed.late) {
      EXPECT_LT(loop.frame, frame);
      EXPECT_GE(loop.probability, robot.min_score);
      EXPECT_TRUE(late.emplace(loop.frame, loop).second) << loop.frame << " was late twice";
    }
    for (const auto& loop : robot.changed.withdrawn) {
      EXPECT_LT(loop.probability, 0.5);
      EXPECT_TRUE(withdrawn.emplace(loop.frame, loop).second) << loop.frame << " twice";
    }
  }
};

TEST(LateLoops, APathThatBecomesSureFindsTheFramesBefore) {
  Walk walk;
  const int first = walk.robot.frame;
  for (int i = 0; i < 30; ++i) walk.see({{100 + i, kWeak}});
  ASSERT_FALSE(walk.at_once.empty());
  ASSERT_GT(*walk.at_once.begin(), first + 3) << "the first frames alone are far from sure";
  ASSERT_GT(walk.late.size(), 3U);
  for (const auto& [frame, loop] : walk.late) {
    EXPECT_FALSE(walk.at_once.contains(frame)) << frame;
    const std::ptrdiff_t step = 100 + (frame - first);
    EXPECT_NEAR(static_cast<double>(loop.matched_step), static_cast<double>(step), 3) << frame;
    EXPECT_EQ(loop.match, loop.matched_step) << "as the robot numbers places";
  }
  EXPECT_TRUE(walk.withdrawn.empty());
}

TEST(LateLoops, FramesBeforeThePathAreNone) {
  Walk walk;
  const int first = walk.robot.frame;
  for (int i = 0; i < 6; ++i) walk.see({{3000 + 200 * i, {.votes = 6}}});
  for (int i = 0; i < 30; ++i) walk.see({{100 + i, kByNight}});
  for (const auto& [frame, loop] : walk.late) EXPECT_GE(frame, first + 6);
}

TEST(LateLoops, AFrameThatDoesNotShowThePlaceIsNone) {
  Walk walk;
  const int first = walk.robot.frame;
  for (int i = 0; i < 40; ++i) {
    // Frame 17 was not compared with the place, frame 18 speaks against it.
    walk.see(i == 17 ? FoundAt{} : FoundAt{{100 + i, i == 18 ? Found{.votes = 0} : kWeak}});
  }
  EXPECT_FALSE(walk.late.contains(first + 17));
  EXPECT_FALSE(walk.late.contains(first + 18));
  EXPECT_TRUE(walk.late.contains(first + 16));
}

TEST(LateLoops, AFrameThatSeemedToBeSomewhereNewIsNone) {
  Walk walk;
  const int first = walk.robot.frame;
  std::vector<double> elsewhere;
  const auto see = [&](const FoundAt& found) {
    elsewhere.push_back(walk.robot.look(found).belief.elsewhere());
    walk.see(found);
  };
  for (int i = 0; i < 16; ++i) see({{100 + i, kWeak}});
  ASSERT_TRUE(walk.at_once.empty());
  for (int i = 16; i < 20; ++i) see({{100 + i, kByDay}});
  ASSERT_GT(elsewhere[10], 0.6);
  ASSERT_LT(elsewhere[14], 0.4);
  for (int i = 0; i < 16; ++i) {
    EXPECT_EQ(walk.late.contains(first + i), elsewhere[static_cast<std::size_t>(i)] <= 0.5) << i;
  }
}

TEST(LateLoops, ALoopWhoseTwinWinsIsWithdrawn) {
  Walk walk;
  const int first = walk.robot.frame;
  // The way from 3000 looks much like that from 100, until it is seen by itself.
  for (int i = 0; i < 14; ++i) walk.see({{100 + i, {.votes = 28}}, {3000 + i, {.votes = 20}}});
  ASSERT_TRUE(walk.at_once.contains(first + 8));
  ASSERT_TRUE(walk.late.contains(first + 6));
  EXPECT_TRUE(walk.withdrawn.empty());
  for (int i = 14; i < 20; ++i) walk.see({{3000 + i, kByDay}, {100 + i, {.votes = 2}}});
  for (const int frame : {first + 6, first + 8}) {
    ASSERT_TRUE(walk.withdrawn.contains(frame)) << "one was found late, the other at once";
    EXPECT_EQ(walk.withdrawn.at(frame).matched_step, 100 + (frame - first));
  }
  EXPECT_EQ(walk.late.at(first + 8).matched_step, 3008) << "where it was instead";
  EXPECT_EQ(walk.late.at(first + 6).matched_step, 106) << "a frame is late once";
}

TEST(LateLoops, ALoopIsNotWithdrawnWhereThePathEnds) {
  Walk walk;
  for (int i = 0; i < 20; ++i) walk.see({{100 + i, kByDay}});
  for (int i = 0; i < 20; ++i) walk.see({});
  for (int i = 0; i < 20; ++i) walk.see({{3000 + i, kByDay}});
  EXPECT_GE(walk.at_once.size(), 30U);
  EXPECT_TRUE(walk.withdrawn.empty());
}

TEST(LateLoops, FramesOfOneViewShareTheAnswerOfTheirStep) {
  Walk walk;
  const int first = walk.robot.frame;
  for (int i = 0; i < 16; ++i) {
    walk.see({{100 + i, kWeak}});
    walk.see({{100 + i, kWeak}}, false);
  }
  walk.see({{116, kByDay}});
  ASSERT_FALSE(walk.late.empty());
  int of_repeats = 0;
  for (const auto& [frame, loop] : walk.late) {
    const int i = (frame - first) / 2;
    EXPECT_NEAR(static_cast<double>(loop.matched_step), 100.0 + i, 3) << frame;
    of_repeats += (frame - first) % 2;
  }
  EXPECT_GT(of_repeats, 0);
}

TEST(LateLoops, FindChangesNothing) {
  Walk walk;
  for (int i = 0; i < 16; ++i) walk.see({{100 + i, kWeak}});
  const auto update = walk.robot.look({{116, kByDay}});
  const auto find = [&] {
    return walk.robot.late_loops.find(update, true, walk.robot.min_score, walk.robot.loops);
  };
  const auto once = find();
  const auto again = find();
  ASSERT_FALSE(once.late.empty());
  ASSERT_EQ(once.late.size(), again.late.size());
  for (std::size_t i = 0; i < once.late.size(); ++i) {
    EXPECT_EQ(once.late[i].frame, again.late[i].frame);
    EXPECT_EQ(once.late[i].probability, again.late[i].probability);
  }
}

TEST(LateLoops, RejectedAndRemovedPlacesAreNone) {
  for (const bool is_removed : {false, true}) {
    Walk walk;
    const int first = walk.robot.frame;
    for (int i = 0; i < 18; ++i) walk.see({{100 + i, kWeak}});
    ASSERT_TRUE(walk.at_once.empty());
    if (is_removed) {
      walk.robot.late_loops.remove(115);
      walk.robot.late_loops.remove(first + 13);
    } else {
      walk.robot.late_loops.reject(first + 13, 113, walk.robot.loops);
    }
    for (int i = 18; i < 22; ++i) walk.see({{100 + i, kByDay}});
    EXPECT_TRUE(walk.late.contains(first + 16));
    EXPECT_FALSE(walk.late.contains(first + 13));
    EXPECT_EQ(walk.late.contains(first + 15), !is_removed);
  }
}

TEST(LateLoops, ItLooksBackABoundedWay) {
  Walk walk;
  for (int i = 0; i < 16; ++i) walk.see({{100 + i, kWeak}});
  for (int i = 0; i < 400; ++i) walk.see({{115, kWeak}}, false);
  const int end = walk.robot.frame;
  for (int i = 16; i < 20; ++i) walk.see({{100 + i, kByDay}});
  ASSERT_GT(walk.late.size(), 50U);
  for (const auto& [frame, loop] : walk.late) EXPECT_GE(frame, end - 128);
}

TEST(PathMotion, APathEndsMoreSeldomWhereEachStepCountsLess) {
  const Belief belief{{{100, {0.6, 0, 0, 0.4}}}};
  for (const auto& [independence, leave] : {std::pair{1.0, 0.01}, {0.5, 0.01}, {0.1, 0.003}}) {
    const Belief later = one_step_later(belief, leave_probability(independence, {}));
    EXPECT_NEAR(later.leave, leave, 1e-12) << independence;
    EXPECT_NEAR(later.elsewhere(), leave, 1e-12) << independence;
  }
}

TEST(PathMotion, APathThatLastedIsLeftMoreSeldom) {
  EXPECT_NEAR(leave_probability(1, {.steps = 100, .independent = 100}), 1.0 / 300, 1e-12);
  // At ten times the frame rate, ten times as many steps are worth as much.
  EXPECT_NEAR(leave_probability(0.1, {.steps = 1000, .independent = 100}),
              0.1 / (2 * 100 + 100 / 3.0), 1e-12);
}

/// That the robot moved by two steps of every path. Nothing is known of those before step 200.
std::optional<OfMoves> by_two(std::ptrdiff_t step) {
  if (step < 200) return std::nullopt;
  return OfMoves{0, 0, 1, 0, 0, 0, 1, 0, 0};
}

TEST(PathMotion, OdometryTellsHowFar) {
  const Belief belief{{{100, {0.4}}, {200, {0.2, 0, 0, 0.2}}}};
  const Belief later = one_step_later(belief, 0.01, by_two);
  EXPECT_NEAR(later.elsewhere(), 0.2 + 0.8 * 0.01, 1e-12) << "it goes on along each path";
  EXPECT_EQ(later.at(101), one_step_later(belief, 0.01).at(101));
  // Odometry fails as often as a robot takes another pace or turns round, which is once in 100.
  EXPECT_GT(later.at(202), 0.95 * 0.2);
  EXPECT_GT(later.at(198), 0.95 * 0.2);
  EXPECT_GT(later.at(201), 0);
  EXPECT_LT(later.at(201), 0.01);
}

TEST(PathMotion, OneStepEarlierAgreesWithOdometry) {
  const Belief belief{{{200, {0.4}}, {201, {0.4}}}};
  const Belief prior = one_step_later(belief, 0.01, by_two);
  EXPECT_GT(one_step_earlier(belief, prior, {}, Belief{{{202, {1}}}}).at(200), 0.95);
  EXPECT_GT(one_step_earlier(belief, prior, {}, Belief{{{203, {1}}}}).at(201), 0.95);
}

class OneStepEarlier : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(PathMotion, OneStepEarlier, testing::Bool(), [](const auto& odometry) {
  return odometry.param ? "WithOdometry" : "Without";
});

TEST_P(OneStepEarlier, UndoesOneStepLater) {
  Belief belief{{{100, {0.3, 0.05, 0.05, 0.1}}, {200, {0.1, 0.1}}}};
  Belief prior = one_step_later(belief, 0.01, GetParam() ? by_two : AgreementOfMoves());
  const Returns returns = returns_to({100, 101, 500, 100}, kSteps,
                                     [](std::ptrdiff_t step) { return step == 101 ? 0.5 : 1.0; });
  ASSERT_EQ(returns.size(), 3U);
  EXPECT_EQ(returns[2].step, 500);
  EXPECT_EQ(probability_at(returns, 101), probability_at(returns, 100) / 2);
  EXPECT_EQ(probability_at(returns, 102), 0);
  add_returns(returns, prior);
  // A frame that tells nothing leaves the past as it was.
  const Belief same = one_step_earlier(belief, prior, returns, prior);
  for (std::size_t i = 0; i < belief.places.size(); ++i) {
    for (std::size_t m = 0; m < kNumMotions; ++m) {
      EXPECT_NEAR(same.places[i].by_motion[m], belief.places[i].by_motion[m], 1e-12);
    }
  }
  // The robot is sure to be at 102 now: it came from 100, forward, by two steps.
  const Belief sure = one_step_earlier(belief, prior, returns, Belief{{{102, {1}}}});
  EXPECT_GT(sure.places[0].by_motion[0], 0.99);
  EXPECT_LT(sure.at(200), 1e-3);
  // Or at 500, to which it can only have returned.
  const Belief back = one_step_earlier(belief, prior, returns, Belief{{{500, {0.5, 0, 0, 0.5}}}});
  EXPECT_GT(back.elsewhere(), 0.9);
}

}  // namespace
}  // namespace loopbit::test
