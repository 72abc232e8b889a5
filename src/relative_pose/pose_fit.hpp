// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "ray_blocks.hpp"
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
  double cost = 0;  ///< minus twice the log likelihood of the residuals; 0 if all are 0
};

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

DirectionPose direction_pose(const RigidPose& pose);

/// Only the squared residual; about twice as fast.
double epipolar_error_sq(const RayPair& pair, const cv::Matx33d& essential);

/// Those of all pairs; faster still.
std::vector<float> errors_sq(const RayBlocks& pairs, const RigidPose& pose);

cv::Matx33d essential_matrix(const RigidPose& pose);

/// Until the cost no longer falls.
inline constexpr int kMaxSteps = 24;

/// Refines `start` by Levenberg and Marquardt's method, to the likeliest pose if residuals are of a
/// distribution with heavy tails, or of outliers, as likely as the others at `gate` standard
/// deviations.
PoseFit fit_pose(std::span<const RayPair> pairs, const RigidPose& start, FitKind kind, double gate,
                 int max_steps = kMaxSteps);

/// The same for rotation and direction; several times as fast for pairs that are used repeatedly.
PoseFit fit_direction(const RayBlocks& pairs, const RigidPose& start, double gate,
                      int max_steps = kMaxSteps);

/// The cost of a pose as it is, as fit_direction() has it.
double cost_of(const RayBlocks& pairs, const RigidPose& pose, double gate);

/// How far the pose may be off, in the terms of RelativePose::covariance: the spread of poses that
/// are fitted to random halves of the inliers, beginning from `pose` (half-sampling: Efron, "The
/// Jackknife, the Bootstrap and Other Resampling Plans", 1982, chapter 8), and the usual covariance
/// of least squares. Half of the pairs has twice the variance of all, so the spread of a half
/// around the whole is the variance of the whole. Refitting follows the curved valleys of the cost,
/// which its curvature at one point does not show. The halves are the same in each call.
cv::Matx66d covariance_of(std::span<const RayPair> inliers, const RigidPose& pose, FitKind kind,
                          double gate);

/// What other minima of the cost add to the covariance of a direction: the motion to each, times
/// the chance that it is the right one. That is the chance that noise changes the order of their
/// likelihoods, by the spread of the pairs' differences (Vuong, "Likelihood ratio tests for model
/// selection and non-nested hypotheses", 1989).
cv::Matx66d rivalry_of(std::span<const RayPair> pairs, const RigidPose& pose,
                       std::span<const PoseFit> rivals, double gate);

}  // namespace loopbit
