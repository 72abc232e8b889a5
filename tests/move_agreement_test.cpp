// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "move_agreement.hpp"

#include <cmath>
#include <optional>

#include <gtest/gtest.h>

#include "loopbit/odometry.hpp"

namespace loopbit::test {
namespace {

/// Looking along z, turned about y, y down.
cv::Matx44d camera_at(double x, double z, double turn_deg) {
  const double c = std::cos(turn_deg * CV_PI / 180);
  const double s = std::sin(turn_deg * CV_PI / 180);
  return {c, 0, s, x, 0, 1, 0, 0, -s, 0, c, z, 0, 0, 0, 1};
}

/// A path of steps of one metre straight ahead, and then of 10 degrees to the right without a move.
class MoveAgreementTest : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i <= 10; ++i) track_.add(OdometryPose{camera_at(0, i, 0)});
    for (int i = 1; i <= 9; ++i) track_.add(OdometryPose{camera_at(0, 10, 10 * i)});
  }

  /// From `begin` by `moved` frames of the path, if the latest motion is `latest`.
  [[nodiscard]] double likelihood(const cv::Matx44d& latest, int begin, int moved) const {
    const Motion motion{latest, cv::Matx66d::eye() * 1e-6};
    return MoveAgreement(track_, motion, {begin - 1, begin, begin + 1})
        .likelihood(begin + moved)
        .value_or(-1);
  }

  OdometryTrack track_;
};

TEST_F(MoveAgreementTest, TheSameMotionAgreesBest) {
  EXPECT_NEAR(likelihood(camera_at(0, 1, 0), 4, 1), 1, 1e-3);
  // By one step too few or too many, which are three variances each.
  EXPECT_NEAR(likelihood(camera_at(0, 1, 0), 4, 0), std::exp(-1.5), 1e-2);
  EXPECT_NEAR(likelihood(camera_at(0, 1, 0), 4, 2), std::exp(-1.5), 1e-2);
  EXPECT_LT(likelihood(camera_at(0, 1, 0), 4, -1), 0.01);
  // A longer step is as uncertain as it is long.
  EXPECT_NEAR(likelihood(camera_at(0, 3, 0), 4, 3), 1, 1e-3);
  EXPECT_GT(likelihood(camera_at(0, 3, 0), 4, 2), likelihood(camera_at(0, 3, 0), 4, 1));
}

TEST_F(MoveAgreementTest, ReversingIsAMotionBackAlongThePath) {
  EXPECT_NEAR(likelihood(camera_at(0, -1, 0), 4, -1), 1, 1e-3);
  EXPECT_LT(likelihood(camera_at(0, -1, 0), 4, 1), 0.01);
}

TEST_F(MoveAgreementTest, TurnsCountAsMovesDo) {
  EXPECT_NEAR(likelihood(camera_at(0, 0, 10), 14, 1), 1, 1e-3);
  EXPECT_NEAR(likelihood(camera_at(0, 0, 10), 14, 0), std::exp(-1.5), 1e-2);
  EXPECT_LT(likelihood(camera_at(0, 0, -10), 14, 1), 0.01) << "to the other side";
  EXPECT_LT(likelihood(camera_at(0, 0, 10), 4, 1), 0.3) << "the path goes straight on there";
}

TEST_F(MoveAgreementTest, OnlyDifferencesOfPosesCount) {
  // What is a move along x in the odometry's frame is straight ahead for the camera.
  const OdometryTrack::Frame begun = track_.next(OdometryPose{camera_at(0, 10, 90)});
  OdometryTrack onwards = track_;
  onwards.add(OdometryPose{begun.pose});
  const auto ahead = onwards.to_next(20, onwards.next(OdometryPose{camera_at(1, 10, 90)}));
  ASSERT_TRUE(ahead);
  EXPECT_GT(MoveAgreement(onwards, *ahead, {3, 4, 5}).likelihood(5), 0.9);
}

TEST_F(MoveAgreementTest, ACameraAtRestAgreesWithAPathAtRest) {
  OdometryTrack at_rest;
  for (int i = 0; i < 4; ++i) at_rest.add(OdometryPose{camera_at(0, 0, 0)});
  const auto rest = at_rest.between(0, 1);
  ASSERT_TRUE(rest);
  for (const int end : {0, 1, 3}) {
    EXPECT_NEAR(MoveAgreement(at_rest, *rest, {0, 1, 2}).likelihood(end).value_or(-1), 1, 1e-6);
  }
}

TEST_F(MoveAgreementTest, IsNotKnownWithoutOdometry) {
  track_.add(std::nullopt);
  track_.add(OdometryPose{camera_at(0, 10, 90)});
  const Motion latest{camera_at(0, 1, 0), cv::Matx66d::eye()};
  EXPECT_FALSE(MoveAgreement(track_, latest, {19, 20, 21}).likelihood(21));
  EXPECT_FALSE(MoveAgreement(track_, latest, {std::nullopt, 19, 20}).likelihood(20));
  EXPECT_TRUE(MoveAgreement(track_, latest, {18, 19, 20}).likelihood(21))
      << "frames beside it are not needed";
}

}  // namespace
}  // namespace loopbit::test
