// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include "graph_data.hpp"

namespace loopbit::graph {

/// What a robust solution makes of each loop.
struct RobustSolution {
  std::vector<bool> is_kept;
  double cost = 0;  ///< of odometry and kept loops
};

/// Varies `poses` to minimize the squared residuals of `odometry`, and of `loops` with a truncated
/// loss: graduated non-convexity (Yang, Antonante, Tzoumas, Carlone: Graduated Non-Convexity for
/// Robust Spatial Perception, 2020, eq. 12 to 14), in which each loop has a limit of its own, the
/// largest squared residual that is not truncated. `fixed`: keyframes that do not move, one for
/// each part of the graph that nothing else joins.
RobustSolution solve_robustly(std::vector<Pose>& poses, std::span<const Edge> odometry,
                              std::span<const Edge> loops, std::span<const double> limits,
                              std::span<const int> fixed, double seen_within_m);

}  // namespace loopbit::graph
