// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include <opencv2/core.hpp>

#include "loopbit/odometry.hpp"

namespace loopbit {

/// How much of a relative pose is known.
enum class PoseKnown {
  nothing,
  rotation,
  direction,  ///< rotation, and the direction of the translation
  metric,     ///< rotation, and the translation in metres
};

inline constexpr std::array kAllPoseKnown{PoseKnown::nothing, PoseKnown::rotation,
                                          PoseKnown::direction, PoseKnown::metric};

/// The enumerator's name.
std::string_view to_string(PoseKnown known);

/// A motion of which not all may be known. What is not known of the translation and its covariance
/// is as in RelativePose.
struct KnownMotion {
  PoseKnown known = PoseKnown::nothing;
  Motion motion = {};
};

/// The inverse covariance, as g2o's EDGE_SE3:QUAT expects it: of (x, y, z, qx, qy, qz), in which a
/// quaternion's vector is half a rotation vector. What is not known has no information: if only the
/// direction is known, that is the whole translation, since its length is unknown.
cv::Matx66d g2o_information(const KnownMotion& motion);

/// A motion as the line `EDGE_SE3:QUAT from to x y z qx qy qz qw` and the upper triangle of
/// g2o_information(), in g2o's text format.
std::string to_g2o_edge(const KnownMotion& motion, std::int64_t from, std::int64_t to);

/// Position and unit quaternion `x y z qx qy qz qw`, as TUM trajectories and g2o write them.
std::string to_tum_pose(const cv::Matx44d& pose);

}  // namespace loopbit
