// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/odometry.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "loopbit/rigid_motion.hpp"
#include "loopbit/trajectory_error.hpp"

#include "test_support.hpp"

namespace loopbit::test {
namespace {

TEST(OdometryTest, DriftGrowsWithTheSquareRootOfTheDistance) {
  const OdometryDrift drift{.position_per_m = 0.01,
                            .rotation_deg_per_m = 1e-5,
                            .rotation_per_rad = 0,
                            .correlated_m = 10};
  OdometryTrack track(drift);
  for (int k = 0; k <= 1000; ++k) track.add(OdometryPose{level_pose(0, k, 0)});
  // 1 % of 10 m, and 10 times as much after 100 times the distance.
  EXPECT_NEAR(std::sqrt(track.between(0, 10)->covariance(2, 2)), 0.1, 1e-3);
  EXPECT_NEAR(std::sqrt(track.between(0, 1000)->covariance(2, 2)), 1.0, 1e-2);
  EXPECT_NEAR(track.path_m(1000), 1000, 1e-9);
}

TEST(OdometryTest, RotationMovesWhatIsFarAway) {
  OdometryDrift drift{.position_per_m = 1e-5, .rotation_deg_per_m = 0.1, .rotation_per_rad = 0};
  OdometryTrack track(drift);
  for (int k = 0; k <= 100; ++k) track.add(OdometryPose{level_pose(0, k, 0)});
  const Motion motion = track.between(0, 100).value();
  const double turn = std::sqrt(motion.covariance(4, 4));
  EXPECT_NEAR(turn * 180 / std::numbers::pi, 0.1 * std::sqrt(10.0 * 100), 0.01);
  // The sum of independent turns, each times the rest of the way: a third of the variance.
  EXPECT_NEAR(std::sqrt(motion.covariance(0, 0)), turn * 100 / std::sqrt(3), 0.05);
}

/// The covariance of 1000 noisy drives.
TEST(OdometryTest, CovarianceIsThatOfNoisyMotions) {
  const cv::Matx66d step_covariance = cv::Matx66d::diag({1e-4, 2e-4, 3e-4, 1e-6, 4e-6, 2e-6});
  const cv::Matx44d step = level_pose(0.3, 1, 0.2);
  OdometryTrack track;
  cv::Matx44d at = level_pose(5, 7, 2);
  for (int k = 0; k <= 20; ++k) {
    track.add(OdometryPose{at, step_covariance});
    at = at * step;
  }
  for (const auto& [from, to] : {std::pair(3, 18), std::pair(18, 3)}) {
    const Motion motion = track.between(from, to).value();
    Random random;
    cv::Matx66d sum = cv::Matx66d::zeros();
    constexpr int kDrives = 1000;
    for (int drive = 0; drive < kDrives; ++drive) {
      cv::Matx44d noisy = cv::Matx44d::eye();
      for (int k = 0; k < 15; ++k) {
        cv::Matx44d error = cv::Matx44d::eye();
        const auto noise = [&](int i) {
          return std::sqrt(step_covariance(i, i)) * random.normal();
        };
        for (int i = 0; i < 3; ++i) error(i, 3) = noise(i);
        const double x = noise(3);
        const double y = noise(4);
        const double z = noise(5);
        error(0, 1) = -z;
        error(1, 0) = z;
        error(0, 2) = y;
        error(2, 0) = -y;
        error(1, 2) = -x;
        error(2, 1) = x;
        noisy = noisy * step * error;
      }
      if (from > to) noisy = noisy.inv();
      const cv::Matx44d error = rigid::inverse(motion.T_from_to) * noisy;
      const cv::Matx61d small(error(0, 3), error(1, 3), error(2, 3), error(2, 1), error(0, 2),
                              error(1, 0));
      sum += small * small.t() * (1.0 / kDrives);
    }
    for (int i = 0; i < 6; ++i) {
      EXPECT_NEAR(sum(i, i) / motion.covariance(i, i), 1, 0.15) << from << " " << i;
    }
  }
}

TEST(OdometryTest, FramesWithoutOdometryAreBridged) {
  OdometryTrack track;
  track.add(OdometryPose{level_pose(0, 0, 0)});
  track.add(std::nullopt);
  track.add(OdometryPose{level_pose(0, 2, 0)});
  EXPECT_FALSE(track.between(0, 1));
  EXPECT_FALSE(track.between(1, 2));
  EXPECT_NEAR(track.between(0, 2)->T_from_to(2, 3), 2, 1e-12);
  EXPECT_EQ(track.path_m(1), 0);
  EXPECT_EQ(track.path_m(2), 2);
  track.add(std::nullopt);
  track.add(std::nullopt);
  EXPECT_EQ(track.size(), 5);
  EXPECT_FALSE(track.between(2, 4));
  EXPECT_EQ(track.path_m(4), 2) << "as at the last frame with odometry";
  track.add(OdometryPose{level_pose(0, 5, 0)});
  EXPECT_FALSE(track.is_known(4));
  EXPECT_EQ(track.path_m(4), 2);
  EXPECT_NEAR(track.between(2, 5)->T_from_to(2, 3), 3, 1e-12);
  EXPECT_THROW(std::ignore = track.path_m(6), std::out_of_range);
  EXPECT_THROW(std::ignore = track.is_known(-1), std::out_of_range);
}

TEST(OdometryTest, BadPosesAreErrorsAndChangeNothing) {
  OdometryTrack track;
  cv::Matx44d scaled = cv::Matx44d::eye();
  scaled(0, 0) = 2;
  expect_error(ErrorKind::input, {"odometry of frame 0", "rigid"},
               [&] { track.add(OdometryPose{scaled}); });
  cv::Matx44d far = cv::Matx44d::eye();
  far(1, 3) = std::nan("");
  expect_error(ErrorKind::input, {"odometry of frame 0"}, [&] { track.add(OdometryPose{far}); });
  expect_error(ErrorKind::input, {"odometry of frame 0 has a covariance"}, [&] {
    track.add(OdometryPose{cv::Matx44d::eye(), cv::Matx66d::zeros()});
  });
  EXPECT_EQ(track.size(), 0);
  expect_error(ErrorKind::option, {"odometry.position_per_m is -1"},
               [] { OdometryTrack({.position_per_m = -1}); });
}

TEST(TrajectoryErrorTest, AlignmentLeavesOnlyTheError) {
  std::vector<cv::Vec3d> truth;
  std::vector<cv::Vec3d> moved;
  const cv::Matx44d T = level_pose(10, -3, 1.2);
  for (int k = 0; k < 20; ++k) {
    truth.emplace_back(k, 0.1 * k * k, k % 5);
    moved.push_back(T.get_minor<3, 3>(0, 0) * truth.back() + rigid::translation(T));
  }
  EXPECT_NEAR(absolute_trajectory_error_m(moved, truth), 0, 1e-9);
  // A detour of 2 m up and down that no alignment explains.
  for (int k = 0; k < 20; ++k) moved[static_cast<std::size_t>(k)][1] += k % 2 == 0 ? 2 : -2;
  EXPECT_NEAR(absolute_trajectory_error_m(moved, truth), 2, 0.05);
  moved.pop_back();
  expect_error(ErrorKind::option, {"19 positions", "20 true"},
               [&] { (void)absolute_trajectory_error_m(moved, truth); });
}

}  // namespace
}  // namespace loopbit::test
