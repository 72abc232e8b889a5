// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "recent_view.hpp"

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "test_support.hpp"

namespace loopbit::test {
namespace {

constexpr int kSightM = 10;

/// A camera on a line, one frame after the other. It shares geometry with a frame taken at most
/// kSightM from where it is.
class Walk {
 public:
  /// Takes a frame at `position_m`; returns where recent places begin for it.
  PlaceId go_to(int position_m, bool blurred = false) {
    const auto newest = static_cast<PlaceId>(positions_m_.size());
    const bool is_step = view_.empty() || position_of(view_.latest_step()) != position_m;
    int asked = 0;
    const auto look = view_.look(newest, is_step, [&](PlaceId place) {
      ++asked;
      EXPECT_GE(place, 0);
      EXPECT_LT(place, newest);
      return !blurred && std::abs(position_of(place) - position_m) <= kSightM;
    });
    EXPECT_LE(asked, is_step ? 3 : 0);
    EXPECT_EQ(look.is_step, is_step);
    EXPECT_LE(look.begin, newest);
    EXPECT_GE(look.far_step, far_step_) << "the far end never comes back";
    far_step_ = look.far_step;
    begin_ = look.begin;
    positions_m_.push_back(position_m);
    view_.remember(newest, look);
    return begin_;
  }

  /// Drives `frames` frames on, a metre each.
  PlaceId drive(int frames) {
    for (int i = 0; i < frames; ++i) go_to(positions_m_.empty() ? 0 : positions_m_.back() + 1);
    return begin_;
  }

  PlaceId stand(int frames) {
    for (int i = 0; i < frames; ++i) go_to(positions_m_.back());
    return begin_;
  }

  [[nodiscard]] PlaceId newest() const { return static_cast<PlaceId>(positions_m_.size()) - 1; }
  [[nodiscard]] int position_m() const { return positions_m_.back(); }
  [[nodiscard]] int position_of(PlaceId place) const {
    return positions_m_[static_cast<std::size_t>(place)];
  }
  [[nodiscard]] std::size_t far_step() const { return far_step_; }

 private:
  RecentView view_;
  std::vector<int> positions_m_;
  std::size_t far_step_ = 0;
  PlaceId begin_ = 0;
};

TEST(RecentView, FirstFrameHasNothingBefore) {
  Walk walk;
  EXPECT_EQ(walk.go_to(0), 0);
}

TEST(RecentView, StandingStillEverythingIsRecent) {
  Walk walk;
  walk.go_to(0);
  EXPECT_EQ(walk.stand(1000), 0);
}

TEST(RecentView, EverythingIsRecentWhileTheFirstFrameIsInView) {
  Walk walk;
  EXPECT_EQ(walk.drive(kSightM + 1), 0);
}

TEST(RecentView, SteadyDriveKeepsTwiceTheViewClear) {
  Walk walk;
  walk.drive(3 * kSightM);
  for (int i = 0; i < 100; ++i) {
    const PlaceId begin = walk.drive(1);
    EXPECT_EQ(begin, walk.newest() - 2 * kSightM);
  }
}

TEST(RecentView, MarginIsAtMostThirtySteps) {
  // A metre in twenty steps: the view reaches back over 200 of them.
  RecentView view;
  const int reach = 200;
  PlaceId begin = 0;
  for (PlaceId newest = 0; newest < 1000; ++newest) {
    const auto look =
        view.look(newest, true, [&](PlaceId place) { return newest - place <= reach; });
    begin = look.begin;
    view.remember(newest, look);
  }
  EXPECT_EQ(begin, 999 - reach - 30);
}

/// A drive with a companion in view, which is left out if the frame `shows` it.
std::vector<RecentView::Look> drive_with_companion(int frames,
                                                   const std::function<bool(PlaceId)>& shows) {
  RecentView view;
  std::vector<RecentView::Look> looks;
  for (PlaceId newest = 0; newest < frames; ++newest) {
    const bool is_left_out = view.long_in_view().has_value() && shows(newest);
    looks.push_back(view.look(
        newest, true,
        [&](PlaceId place) { return newest - place <= kSightM || (!is_left_out && shows(newest)); },
        is_left_out));
    view.remember(newest, looks.back());
    EXPECT_TRUE(view.is_in_view(static_cast<PlaceId>(looks.back().companion_step)));
  }
  return looks;
}

TEST(RecentView, ACompanionIsNoView) {
  const auto looks = drive_with_companion(300, [](PlaceId /*newest*/) { return true; });
  for (std::size_t i = 0; i <= 64; ++i) EXPECT_EQ(looks[i].begin, 0) << i;
  // The far end moves on by two steps a step, until the scene is in view.
  for (std::size_t i = 130; i < looks.size(); ++i) {
    EXPECT_EQ(looks[i].begin, static_cast<PlaceId>(i) - kSightM - 30);
    EXPECT_EQ(looks[i].companion_step, 0U);
  }
}

TEST(RecentView, WhereACompanionIsNotSeenAllSinceThenIsRecent) {
  const auto looks = drive_with_companion(300, [](PlaceId newest) { return newest != 200; });
  EXPECT_EQ(looks[199].begin, 199 - kSightM - 30);
  EXPECT_EQ(looks[200].begin, 0);
  EXPECT_EQ(looks[201].begin, 201 - kSightM - 30);
}

TEST(RecentView, ACompanionThatLeavesIsForgotten) {
  const auto looks = drive_with_companion(500, [](PlaceId newest) { return newest < 200; });
  EXPECT_EQ(looks.back().begin, 499 - 2 * kSightM);
  EXPECT_EQ(looks.back().companion_step, looks.back().far_step);
}

TEST(RecentView, WhatCannotBeLeftOutStaysInView) {
  RecentView view;
  for (PlaceId newest = 0; newest < 300; ++newest) {
    const auto look = view.look(newest, true, [](PlaceId /*place*/) { return true; });
    EXPECT_EQ(look.begin, 0);
    view.remember(newest, look);
  }
}

TEST(RecentView, StandingStillDoesNotMoveTheBegin) {
  Walk walk;
  walk.drive(100);
  const PlaceId begin = walk.stand(1);
  EXPECT_LE(begin, walk.newest() - 2 * kSightM);
  EXPECT_EQ(walk.stand(500), begin);
}

TEST(RecentView, LeavingAfterAStandstillIsAsIfThereWasNone) {
  Walk walk;
  walk.drive(100);
  walk.stand(500);
  const PlaceId begin = walk.drive(2 * kSightM + 1);
  EXPECT_EQ(begin, walk.newest() - 2 * kSightM);
}

TEST(RecentView, OneBlurredFrameMovesTheFarEndByTwoSteps) {
  Walk walk;
  walk.drive(100);
  const std::size_t far = walk.far_step();
  walk.go_to(walk.position_m() + 1, true);
  EXPECT_EQ(walk.far_step(), far + 2);
  // The drive catches up with it.
  walk.drive(1);
  EXPECT_EQ(walk.far_step(), far + 2);
  walk.drive(2);
  EXPECT_EQ(walk.far_step(), far + 4);
}

TEST(RecentView, LostViewIsLeftBehindAtTwoStepsAStep) {
  Walk walk;
  walk.drive(100);
  walk.go_to(100'000);  // carried away: eleven steps are to be left behind
  walk.drive(4);
  EXPECT_LT(walk.far_step(), 100U);
  walk.drive(1);
  EXPECT_EQ(walk.far_step(), 100U);
}

TEST(RecentView, NothingInViewMakesOnlyTheNewestRecent) {
  RecentView view;
  for (PlaceId newest = 0; newest < 50; ++newest) {
    const auto look = view.look(newest, true, [](PlaceId) { return false; });
    EXPECT_EQ(look.begin, newest);
    view.remember(newest, look);
  }
}

TEST(RecentView, TurningBackKeepsThePlaceInView) {
  Walk walk;
  walk.drive(100);
  // To and fro within sight of one place: the view never broke.
  PlaceId begin = 0;
  for (int i = 0; i < 300; ++i) begin = walk.go_to(99 + (i / 4) % 2 + i % 3);
  EXPECT_LE(begin, 100);
}

TEST(RecentView, FramesBetweenStepsCountAsPlaces) {
  // Only every fifth frame is a step; the begin is a place, not a step.
  RecentView view;
  PlaceId begin = 0;
  for (PlaceId newest = 0; newest < 200; ++newest) {
    const auto look =
        view.look(newest, newest % 5 == 0, [&](PlaceId place) { return newest - place <= 20; });
    begin = look.begin;
    view.remember(newest, look);
  }
  EXPECT_EQ(begin % 5, 0);
  EXPECT_NEAR(begin, 199 - 2 * 20, 10);
}

TEST(RecentView, LookChangesNothing) {
  RecentView view;
  view.remember(0, view.look(0, true, [](PlaceId) { return true; }));
  view.remember(1, view.look(1, true, [](PlaceId) { return true; }));
  static_cast<void>(view.look(2, true, [](PlaceId) { return false; }));
  const auto look = view.look(2, true, [](PlaceId) { return true; });
  EXPECT_EQ(look.far_step, 0U);
  EXPECT_EQ(view.latest_step(), 1);
}

TEST(RecentView, StepOfAPlaceIsTheLastStepUpToIt) {
  RecentView view;
  EXPECT_EQ(view.step_of(0), -1);
  // Frames 0 and 1 have no image; 2, 5 and 6 change the view.
  for (const PlaceId step : {2, 5, 6}) {
    view.remember(step, view.look(step, true, [](PlaceId) { return true; }));
  }
  view.remember(7, view.look(7, false, [](PlaceId) { return true; }));
  EXPECT_EQ(view.step_of(1), -1);
  EXPECT_EQ(view.step_of(2), 0);
  EXPECT_EQ(view.step_of(4), 0);
  EXPECT_EQ(view.step_of(5), 1);
  EXPECT_EQ(view.step_of(6), 2);
  EXPECT_EQ(view.step_of(7), 2);
}

TEST(RecentView, BeginNeverPassesTheFarEndHoweverTheCameraMoves) {
  Random random;
  for (int run = 0; run < 20; ++run) {
    Walk walk;
    int position_m = 0;
    for (int i = 0; i < 300; ++i) {
      if (random.between(0, 3) > 0) position_m += random.between(-2, 5);
      if (random.between(0, 80) == 0) position_m += 1000;
      walk.go_to(position_m, random.between(0, 5) == 0);  // checks what always holds
    }
  }
}

}  // namespace
}  // namespace loopbit::test
