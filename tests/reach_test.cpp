// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "reach.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "loopbit/loop_detector.hpp"

#include "map_support.hpp"
#include "session_odometry.hpp"
#include "shortcuts.hpp"
#include "test_support.hpp"

namespace loopbit {
namespace {

/// Looking along z, y down.
OdometryPose camera_at(double x, double y, double z) {
  return {{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}};
}

/// Of a robot that drove `path_m` along z and back before it got to `now`.
double chi2_after(double path_m, const OdometryPose& now, const OdometryDrift& drift = {}) {
  OdometryTrack track(drift);
  track.add(camera_at(0, 0, 0));
  for (int metre = 1; metre <= path_m; ++metre) {
    track.add(camera_at(0, 0, std::min<double>(metre, path_m - metre)));
  }
  const Shortcuts none;
  SurestPaths paths(track, none, Reach::views_sq({}));
  return Reach(track, paths, now, {}).chi2(0);
}

bool is_in_reach(double chi2) { return chi2 <= Reach::kMaxChi2; }

constexpr OdometryDrift kNoTurns{.rotation_deg_per_m = 1e-5, .rotation_per_rad = 0};

TEST(ReachTest, ViewsOfOnePlaceMayBeALaneApartButNoStorey) {
  for (const double side : {-1.0, 1.0}) {
    EXPECT_TRUE(is_in_reach(chi2_after(10, camera_at(3.5 * side, 0, 0), kNoTurns)));
    EXPECT_TRUE(is_in_reach(chi2_after(10, camera_at(0, 0, 5 * side), kNoTurns)));
    EXPECT_TRUE(is_in_reach(chi2_after(10, camera_at(3.5 * side, 0.5, 2), kNoTurns)));
    EXPECT_FALSE(is_in_reach(chi2_after(10, camera_at(0, 3 * side, 0), kNoTurns)));
    EXPECT_FALSE(is_in_reach(chi2_after(10, camera_at(8 * side, 0, 0), kNoTurns)));
  }
}

TEST(ReachTest, DriftWidensIt) {
  // 1 % of 10 m after 10 m, ten times as much after a hundred times the way.
  EXPECT_FALSE(is_in_reach(chi2_after(100, camera_at(0, 3, 0), kNoTurns)));
  EXPECT_TRUE(is_in_reach(chi2_after(1000, camera_at(0, 3, 0), kNoTurns)));
  EXPECT_FALSE(is_in_reach(chi2_after(1000, camera_at(0, 8, 0), kNoTurns)));
  EXPECT_TRUE(is_in_reach(chi2_after(1000, camera_at(0, 8, 0), {.position_per_m = 0.03})));
}

TEST(ReachTest, WithoutOdometryEverythingIsInReach) {
  OdometryTrack track;
  track.add(std::nullopt);
  const Shortcuts none;
  SurestPaths paths(track, none, Reach::views_sq({}));
  EXPECT_EQ(Reach(track, paths, camera_at(100, 0, 0), {}).chi2(0), 0);
}

/// Far away and back to the start: a frame per metre, with odometry that keeps its heading.
struct LongWay {
  static constexpr int kBack = 200;

  OdometryTrack track;
  Shortcuts shortcuts;
  SurestPaths paths = SurestPaths(track, shortcuts, Reach::views_sq({}));

  LongWay() {
    for (int metre = 0; metre <= kBack; ++metre) {
      OdometryPose pose = camera_at(0, 0, std::min(metre, kBack - metre));
      pose.covariance = cv::Matx66d::diag({4e-3, 4e-3, 4e-3, 1e-12, 1e-12, 1e-12});
      track.add(pose);
    }
  }

  void add(const Shortcuts::Loop& loop) {
    shortcuts.commit(shortcuts.prepare(loop, false));
    shortcuts.commit(shortcuts.prepare({}, true));
  }

  [[nodiscard]] double chi2(int frame, double height_m) {
    return Reach(track, paths, camera_at(0, -height_m, 1), {}).chi2(frame);
  }
};

TEST(ReachTest, ALoopIsAShortcut) {
  LongWay way;
  EXPECT_TRUE(is_in_reach(way.chi2(2, 3)));
  way.add({.frame = LongWay::kBack, .match = 0});
  EXPECT_FALSE(is_in_reach(way.chi2(2, 3)));
  EXPECT_TRUE(is_in_reach(way.chi2(2, 0)));
  way.shortcuts.remove(LongWay::kBack);
  EXPECT_TRUE(is_in_reach(way.chi2(2, 3)));
}

TEST(ReachTest, ALoopIsNoShortcutBeforeAnotherAgrees) {
  LongWay way;
  way.shortcuts.commit(way.shortcuts.prepare({.frame = LongWay::kBack, .match = 0}, false));
  EXPECT_TRUE(is_in_reach(way.chi2(2, 3)));
  way.shortcuts.commit(way.shortcuts.prepare({}, false));
  EXPECT_TRUE(is_in_reach(way.chi2(2, 3)));
}

TEST(ReachTest, AShortcutThatOdometryContradictsIsNotTaken) {
  LongWay way;
  way.add({.frame = LongWay::kBack, .match = 60});  // where the robot was 60 m from there
  EXPECT_EQ(way.chi2(2, 0), LongWay().chi2(2, 0));
}

/// The variance of each frame's position upwards as seen from the last one: over all paths, slowly.
std::vector<double> least_variances(const OdometryTrack& track, const Shortcuts& shortcuts,
                                    double apart_sq) {
  const int last = track.size() - 1;
  std::vector<double> least(static_cast<std::size_t>(last + 1), 1e9);
  least.back() = 0;
  const auto shorten = [&](int from, int to, double step) {
    const double by_it = least.at(static_cast<std::size_t>(from)) + step;
    least.at(static_cast<std::size_t>(to)) =
        std::min(least.at(static_cast<std::size_t>(to)), by_it);
  };
  std::vector<double> steps;
  for (int frame = 0; frame < last; ++frame) {
    steps.push_back(track.between(frame, frame + 1)->covariance(1, 1));
  }
  for (int pass = 0; pass <= last; ++pass) {
    for (int frame = 0; frame < last; ++frame) {
      shorten(frame, frame + 1, steps[static_cast<std::size_t>(frame)]);
      shorten(frame + 1, frame, steps[static_cast<std::size_t>(frame)]);
    }
    for (const auto& [from, to] : shortcuts.ends()) shorten(from, to, apart_sq);
  }
  return least;
}

TEST(ReachTest, ThePathIsTheSurestOfAll) {
  cv::RNG random(35);
  for (int trial = 0; trial < 20; ++trial) {
    LongWay way;
    for (int loop = 0; loop < 8; ++loop) {
      const int frame = random.uniform(1, LongWay::kBack);
      way.add({.frame = frame, .match = random.uniform(0, frame)});
    }
    const cv::Vec3d apart_sq(2, 0.1, 2);
    const auto expected = least_variances(way.track, way.shortcuts, apart_sq[1]);
    const auto now = way.track.next(camera_at(0, 0, 0));
    SurestPaths paths(way.track, way.shortcuts, apart_sq);
    for (int frame = 0; frame < LongWay::kBack; frame += random.uniform(1, 20)) {
      const Motion direct = way.track.to_next(frame, now).value();
      const Motion found = paths.from(frame, now, direct).value_or(direct);
      const double still = way.track.to_next(LongWay::kBack, now)->covariance(1, 1);
      EXPECT_NEAR(found.covariance(1, 1), expected[static_cast<std::size_t>(frame)] + still, 1e-5);
    }
  }
}

TEST(ReachTest, WeightsAreLikelihoods) {
  EXPECT_EQ(Reach::weight(0), 1);
  EXPECT_EQ(Reach::weight(3), 1);
  EXPECT_NEAR(Reach::weight(13), std::exp(-5), 1e-12);
}

TEST(SessionOdometryTest, MovesAgreeAlongThePathAndBeyondItsEnds) {
  const LoopDetectorOptions options;
  Places places(options, nullptr);
  SessionOdometry odometry(options, places);
  EXPECT_FALSE(odometry.agreement_of_moves(camera_at(0, 0, 0))) << "there is no step to move from";
  for (int frame = 0; frame < 20; ++frame) {
    places.add(test::content_of(frame), {}, RecentView::Look{.is_step = true}, {}, {});
    odometry.add(camera_at(0, 0, frame));
  }
  EXPECT_FALSE(odometry.agreement_of_moves(std::nullopt));
  const auto agreement = odometry.agreement_of_moves(camera_at(0, 0, 20));
  ASSERT_TRUE(agreement);
  const auto expect_ahead = [](const OfMoves& moves) {
    EXPECT_NEAR(moves[kMaxMove], std::exp(-1.5), 0.01);
    EXPECT_NEAR(moves[kMaxMove + 1], 1, 0.01);
    EXPECT_NEAR(moves[kMaxMove + 2], std::exp(-1.5), 0.01);
  };
  const auto middle = agreement(10);
  ASSERT_TRUE(middle);
  expect_ahead(*middle);
  EXPECT_LT((*middle)[kMaxMove - 1], 0.01);
  const auto begin = agreement(0);
  ASSERT_TRUE(begin);
  expect_ahead(*begin);
  for (std::size_t i = 0; i < kMaxMove; ++i) EXPECT_EQ((*begin)[i], 1) << i;
  EXPECT_FALSE(agreement(-1)) << "steps below 0 are those of other sessions";
}

/// A walk of two laps through twenty views, with odometry.
std::vector<Detection> two_laps(const std::function<std::optional<OdometryPose>(int)>& odometry) {
  LoopDetector detector(test::fast_options());
  std::vector<Detection> detections;
  for (int frame = 0; frame < 80; ++frame) {
    detections.push_back(detector.process(test::view(frame % 40), std::nullopt, odometry(frame)));
  }
  return detections;
}

int count(const std::vector<Detection>& detections, Status status) {
  return static_cast<int>(std::ranges::count(detections, status, &Detection::status));
}

/// Around a circle of 40 m, `lift_m` higher after each lap.
OdometryPose around(int frame, double lift_m) {
  const double turned = 2 * CV_PI * frame / 40;
  return camera_at(6.4 * std::cos(turned), -lift_m * (frame / 40), 6.4 * std::sin(turned));
}

TEST(DetectorReach, LoopsMakeItNarrower) {
  LoopDetectorOptions options = test::fast_options();
  options.odometry = {
      .position_per_m = 0.1, .rotation_deg_per_m = 1e-5, .rotation_per_rad = 0, .correlated_m = 2};
  // After two laps around the circle, the first views of the first one from a storey above.
  const auto loops_above = [&](int second_lap) {
    LoopDetector detector(options);
    std::vector<Detection> above;
    for (int frame = 0; frame < 86; ++frame) {
      const int view = frame / 40 == 1 ? second_lap + frame - 40 : frame % 40;
      OdometryPose odometry = around(frame % 40, 0);
      if (frame >= 80) odometry.T_odometry_camera(1, 3) = -3;
      const Detection detection = detector.process(test::view(view), std::nullopt, odometry);
      if (frame >= 80) above.push_back(detection);
    }
    return count(above, Status::loop);
  };
  const int other_views = 100;
  EXPECT_GT(loops_above(other_views), 3) << "drift hides the storey";
  EXPECT_EQ(loops_above(0), 0);
}

TEST(DetectorOdometry, TheSameMotionAsOnThePathSpeaksForIt) {
  // All is in reach. By odometry, the second lap goes as the first one, or stands still.
  const auto path_term = [](bool moves) {
    const auto detections = two_laps([moves](int frame) {
      return camera_at(0, 0, 0.1 * (moves || frame < 40 ? frame % 40 : 20));
    });
    const Detection& second_loop = detections[41];
    EXPECT_EQ(second_loop.match, 1);
    return second_loop.terms ? second_loop.terms->path : 0;
  };
  EXPECT_GT(path_term(true), path_term(false) + 0.5);
}

TEST(DetectorReach, APlaceOutOfReachIsNoLoop) {
  const auto without = two_laps([](int) { return std::nullopt; });
  ASSERT_GT(count(without, Status::loop), 20);
  const auto same_floor = two_laps([](int frame) { return around(frame, 0); });
  EXPECT_GE(count(same_floor, Status::loop), count(without, Status::loop) - 2);
  EXPECT_EQ(count(same_floor, Status::unreachable), 0);
  const auto next_floor = two_laps([](int frame) { return around(frame, 10); });
  EXPECT_EQ(count(next_floor, Status::loop), 0);
  EXPECT_GT(count(next_floor, Status::unreachable), 20);
  for (const Detection& detection : next_floor) {
    if (detection.status != Status::unreachable) continue;
    EXPECT_EQ(detection.match, detection.frame - 40);
    EXPECT_EQ(detection.score, 0);
    EXPECT_FALSE(detection.terms);
    EXPECT_GT(detection.inliers, 0);
  }
}

}  // namespace
}  // namespace loopbit
