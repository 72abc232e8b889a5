// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>

#include <opencv2/core.hpp>

#include "loopbit/loop_graph.hpp"

#include "symmetric_matrix.hpp"

namespace loopbit::graph {

/// Position and quaternion (x, y, z, w), as Ceres varies them.
using Pose = std::array<double, 7>;

inline constexpr Pose kIdentity{0, 0, 0, 0, 0, 0, 1};

Pose pose_of(const cv::Matx44d& transform);
cv::Matx44d matrix_of(const Pose& pose);
/// x_a = T_a_b x_b, with T_a_b = T_w_a^-1 T_w_b.
Pose between(const Pose& a, const Pose& b);
Pose times(const Pose& a, const Pose& b);
Pose inverse(const Pose& pose);
/// As rigid::adjoint().
Matrix6d adjoint(const Pose& pose);

Matrix6d eigen_of(const cv::Matx66d& matrix);
cv::Matx66d cv_of(const Matrix6d& matrix);

/// What was measured between two keyframes.
struct Edge {
  int from = 0;
  int to = 0;
  PoseKnown known = PoseKnown::metric;
  Pose measured = kIdentity;
  /// Of a small motion in the frame `to`; as large as what is known.
  Matrix6d information = Matrix6d::Zero();
};

/// A keyframe as odometry has it.
struct Keyframe {
  int chain = 0;  ///< keyframes that odometry connects have the same
  std::optional<Edge> odometry;
  Pose reckoned = kIdentity;          ///< by odometry alone, from the first of the chain
  Matrix6d drift = Matrix6d::Zero();  ///< since then, summed up in the frame of the first
};

/// The value that a chi-squared variable of `freedom` degrees (1 to 9) exceeds with the probability
/// 1 - confidence. By Wilson and Hilferty (1931), good to 1 % here.
double chi2_limit(double confidence, int freedom);

}  // namespace loopbit::graph
