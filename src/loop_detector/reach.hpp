// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <unordered_map>

#include <opencv2/core.hpp>

#include "loopbit/loop_detector_options.hpp"
#include "loopbit/odometry.hpp"

#include "shortcuts.hpp"

namespace loopbit {

/// How far the robot is now from earlier frames of a session, as far as odometry tells. It
/// remembers its answers. Not thread-safe.
class Reach {
 public:
  /// Of three degrees of freedom: right loops exceed it once in 1,000.
  static constexpr double kMaxChi2 = 16.27;

  /// Variances of the distance of two views of one place, along the axes of the camera: those of
  /// decision.reach_m to the side and ahead, and reach_up_m upwards, which are kMaxChi2 by
  /// themselves.
  static cv::Vec3d views_sq(const DecisionOptions& decision);

  /// `track` and `paths`, which has the same views_sq(), must outlive this. `now`: the frame to
  /// come.
  Reach(const OdometryTrack& track, SurestPaths& paths, const OdometryPose& now,
        const DecisionOptions& decision)
      : track_(&track), paths_(&paths), now_(track.next(now)), views_sq_(views_sq(decision)) {}

  /// The squared Mahalanobis distance of the two cameras. Its covariance is the drift of odometry
  /// since, and the distance that two views of one place may have. If loops make for a surer path,
  /// the larger distance of both. 0 if odometry is not known at `frame`.
  [[nodiscard]] double chi2(int frame) const;

  /// The same along one loop: from `frame` by odometry to its match, and on from its frame.
  [[nodiscard]] double chi2(const Shortcuts::Loop& by, int frame) const;

  /// The likelihood of `chi2`, as a share of what a right loop has on average. At most 1.
  [[nodiscard]] static double weight(double chi2);

 private:
  [[nodiscard]] double measure(int frame) const;
  [[nodiscard]] double chi2(const Motion& to_now) const;

  const OdometryTrack* track_;
  SurestPaths* paths_;
  OdometryTrack::Frame now_;
  cv::Vec3d views_sq_;                            ///< variances of the distance of two views
  mutable std::unordered_map<int, double> chi2_;  ///< by frame
};

}  // namespace loopbit
