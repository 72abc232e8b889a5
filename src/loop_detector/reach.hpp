// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <unordered_map>

#include <opencv2/core.hpp>

#include "loopbit/loop_detector_options.hpp"
#include "loopbit/odometry.hpp"

namespace loopbit {

/// How far the robot is now from earlier frames of a session, as far as odometry tells. It
/// remembers its answers. Not thread-safe.
class Reach {
 public:
  /// Of three degrees of freedom: right loops exceed it once in 1,000.
  static constexpr double kMaxChi2 = 16.27;

  /// `track` must outlive this. `now`: the frame to come. `decision` has how far apart two views of
  /// one place may be.
  Reach(const OdometryTrack& track, const OdometryPose& now, const DecisionOptions& decision)
      : track_(&track),
        now_(track.next(now)),
        reach_m_(decision.reach_m, decision.reach_up_m, decision.reach_m) {}

  /// The squared Mahalanobis distance of the two cameras. Its covariance is the drift of odometry
  /// since, and the distance that two views of one place may have: reach_m to the side and ahead,
  /// reach_up_m upwards, which are kMaxChi2 by themselves. 0 if odometry is not known at `frame`.
  [[nodiscard]] double chi2(int frame) const;

  /// The likelihood of `chi2`, as a share of what a right loop has on average. At most 1.
  [[nodiscard]] static double weight(double chi2);

 private:
  [[nodiscard]] double measure(int frame) const;

  const OdometryTrack* track_;
  OdometryTrack::Frame now_;
  cv::Vec3d reach_m_;
  mutable std::unordered_map<int, double> chi2_;  ///< by frame
};

}  // namespace loopbit
