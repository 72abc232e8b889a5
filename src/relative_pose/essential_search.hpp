// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "pose_fit.hpp"
#include "ray_pairs.hpp"

namespace loopbit {

/// The rotation that best turns the query's rays into those of the match (Kabsch 1976).
cv::Matx33d rotation_between(std::span<const RayPair> pairs);

struct DirectionSearch {
  PoseFit best;
  std::vector<PoseFit> rivals;  ///< other minima of the cost, best first
};

/// The pose, with a translation of length 1, that explains the pairs best. A fundamental matrix of
/// virtual pinhole images separates most outliers (epipolar_inliers()). The cost has many minima,
/// so translations in all directions are starting points, each fitted to a few pairs drawn at
/// random; the best that differ are refined on all. `gate`: in standard deviations; beyond it a
/// pair is rather an outlier. None with fewer than 8 inliers.
std::optional<DirectionSearch> search_direction(std::span<const RayPair> pairs, double gate);

/// If the pairs' points lie on a plane: the other pose that explains them, as the decomposition of
/// their homography gives it (Ma, Soatto, Kosecka, Sastry, "An Invitation to 3-D Vision", section
/// 5.3). None if they do not, or if it would put points behind the camera.
std::optional<PoseFit> rival_of_plane(std::span<const RayPair> pairs, const PoseFit& fit,
                                      double gate);

}  // namespace loopbit
