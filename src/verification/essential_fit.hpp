// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <opencv2/core.hpp>

namespace loopbit {

/// The direction, of unit length, in which a calibrated camera sees a point.
struct ViewRay {
  cv::Vec3f direction;
  float spread_sq = 0;  ///< what one pixel turns it by, rad^2
};

struct ViewRayPair {
  ViewRay first;
  ViewRay second;
};

/// The motion of a camera from one image to the other.
struct ViewMotion {
  cv::Matx33d rotation;
  cv::Vec3d translation;  ///< of length 1

  [[nodiscard]] cv::Matx33d essential() const;
};

/// The motion that explains `pairs` best, by the angles between rays and epipolar planes in pixels,
/// with Huber's loss from `huber_px` on. The cost has several minima, so the search begins at the
/// one nearest to `model`, a matrix of rays, and at translations all over a half sphere. Which of
/// the four motions of one essential matrix it finds is left open. Needs 5 pairs.
ViewMotion find_motion(std::span<const ViewRayPair> pairs, const cv::Matx33d& model,
                       double huber_px);

/// Refines `motion` by Levenberg and Marquardt's method, with the same cost.
void refine_motion(std::span<const ViewRayPair> pairs, double huber_px, ViewMotion& motion);

}  // namespace loopbit
