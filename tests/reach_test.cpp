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
  return Reach(track, now, {}).chi2(0);
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
  EXPECT_EQ(Reach(track, camera_at(100, 0, 0), {}).chi2(0), 0);
}

TEST(ReachTest, WeightsAreLikelihoods) {
  EXPECT_EQ(Reach::weight(0), 1);
  EXPECT_EQ(Reach::weight(3), 1);
  EXPECT_NEAR(Reach::weight(13), std::exp(-5), 1e-12);
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
