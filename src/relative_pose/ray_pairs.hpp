// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include <opencv2/core.hpp>

#include "loopbit/relative_pose.hpp"

namespace loopbit {

/// The direction in which a camera sees a keypoint.
struct Ray {
  cv::Vec3d direction;  ///< unit length
  cv::Matx32d spread;   ///< d direction / d position in standard deviations of a keypoint
};

/// The ray of a keypoint. `sigma_px`: its standard deviation, px of the working image. None if the
/// lens has no ray there.
std::optional<Ray> ray_of(const PoseView& view, int keypoint);

/// Two rays that may meet in a point.
struct RayPair {
  Ray query;
  Ray match;
  Match features = {};
  double inverse_depth = 0;        ///< 1 / distance from the match's camera, if known, 1/m
  double inverse_depth_sigma = 0;  ///< its standard deviation; 0 = not known
  /// Its derivative by the position of the match's keypoint in standard deviations, which is not
  /// part of inverse_depth_sigma.
  cv::Vec2d inverse_depth_by_match = {};

  [[nodiscard]] bool has_depth() const { return inverse_depth_sigma > 0; }
};

/// Standard deviation of a keypoint, px of the working image.
double keypoint_sigma_px(const Keypoint& keypoint);

}  // namespace loopbit
