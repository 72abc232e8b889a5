// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/loop_graph.hpp"
#include "loopbit/odometry.hpp"

namespace loopbit::bench {

struct SyntheticGraphOptions {
  int keyframes = 1000;      ///< 1 m apart
  int loops = 500;           ///< right ones, at most
  double wrong_share = 0;    ///< wrong loops, as a share of all
  int blocks = 8;            ///< of the town, along each side, of 10 m each
  OdometryDrift drift = {};  ///< of the odometry
  std::uint64_t seed = 1;
};

/// A drive through the streets of a town, with noisy odometry and loops.
struct SyntheticGraph {
  std::vector<cv::Matx44d> truth;  ///< T_world_camera of each keyframe
  std::vector<Motion> odometry;    ///< from keyframe k to k + 1
  std::vector<LoopEdge> loops;     ///< by query
  std::vector<bool> is_right;      ///< of each loop
};

/// Right loops have errors of 0.05 m and 0.3 degrees. Wrong ones join two keyframes at random, with
/// a pose as right ones have: two places that look alike.
SyntheticGraph make_synthetic_graph(const SyntheticGraphOptions& options);

/// The root mean square error of a trajectory, see absolute_trajectory_error_m().
double trajectory_error_m(const std::vector<cv::Matx44d>& poses, const SyntheticGraph& graph);

/// What odometry alone says.
std::vector<cv::Matx44d> dead_reckoning(const SyntheticGraph& graph);

}  // namespace loopbit::bench
