// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "ray_pairs.hpp"

namespace loopbit {

/// The pose of the query's camera in the frame of the match's.
struct RigidPose {
  cv::Matx33d rotation = cv::Matx33d::eye();
  cv::Vec3d translation;
};

/// What of a pose is fitted.
enum class FitKind {
  rotation,   ///< the rotation; the translation stays 0
  direction,  ///< the translation keeps the length 1
  metric,
};

struct PoseFit {
  RigidPose pose;
  double cost = 0;  ///< the sum of truncated squared residuals, in standard deviations
};

/// The rotation by the vector `r`, Rodrigues' formula.
cv::Matx33d rotation_by(const cv::Vec3d& r);

/// The squared residual of a pair, in standard deviations, and the number of its equations: one
/// (the epipolar constraint; Sampson's distance) or, if its depth is known or `kind` is rotation,
/// two.
struct Residual {
  int size = 0;
  cv::Vec2d value;
  cv::Matx<double, 2, 6> jacobian;

  [[nodiscard]] double norm_sq() const { return value.dot(value); }
};
Residual residual_of(const RayPair& pair, const RigidPose& pose, FitKind kind);

/// Only the squared residual; about twice as fast.
double epipolar_error_sq(const RayPair& pair, const cv::Matx33d& essential);

cv::Matx33d essential_matrix(const RigidPose& pose);

/// Enough for the inliers to settle.
inline constexpr int kFitRounds = 3;

/// Refines `start` by Levenberg and Marquardt's method with Huber's loss. Pairs further than `gate`
/// standard deviations do not count; which these are is decided anew in each of `rounds`.
PoseFit fit_pose(std::span<const RayPair> pairs, const RigidPose& start, FitKind kind, double gate,
                 int rounds);

/// How far the pose may be off, in the terms of RelativePose::covariance: the spread of poses that
/// are fitted to random halves of the inliers, beginning from `pose` (half-sampling: Efron, "The
/// Jackknife, the Bootstrap and Other Resampling Plans", 1982, chapter 8), plus the usual
/// covariance of least squares. Half of the pairs has twice the variance of all, so the spread of a
/// half around the whole is the variance of the whole. Refitting follows the curved valleys of the
/// cost, which its curvature at one point does not show. The halves are the same in each call.
cv::Matx66d covariance_of(std::span<const RayPair> inliers, const RigidPose& pose, FitKind kind);

}  // namespace loopbit
