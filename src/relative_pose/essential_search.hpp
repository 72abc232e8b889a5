// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "pose_fit.hpp"
#include "ray_pairs.hpp"

namespace loopbit {

/// The pose, with a translation of length 1, that explains most of the pairs: a fundamental matrix
/// of virtual pinhole images separates most outliers (epipolar_inliers(), RANSAC over seven), then
/// samples of five of its inliers go through OpenCV's five-point solver. `gate`: in standard
/// deviations. None if no sample gives a pose.
std::optional<RigidPose> search_essential(std::span<const RayPair> pairs, double gate);

/// The poses of an essential matrix that put most of the pairs' points before both cameras; two, if
/// they do so equally well.
RigidPose pose_before_cameras(const cv::Matx33d& essential, std::span<const RayPair> pairs,
                              double gate);

/// Another pose that explains pairs on a plane as `pose` does, if they lie on one; see Ma, Soatto,
/// Kosecka, Sastry, "An Invitation to 3-D Vision", section 5.3. None if they do not.
std::optional<RigidPose> other_pose_of_plane(std::span<const RayPair> pairs, const RigidPose& pose,
                                             double gate);

}  // namespace loopbit
