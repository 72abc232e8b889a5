// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "graph_data.hpp"
#include "loop_consistency.hpp"

namespace loopbit::graph {

/// How well a solved graph knows the motion between two keyframes, bounded from above: along the
/// path of edges that is the most certain. The exact covariance takes a hundred times as long.
class PathCovariance {
 public:
  PathCovariance(const std::vector<Pose>& poses, std::span<const WideLoop> motions);

  /// Of a small motion in the frame `to`. None if no path joins the two. Cost: 0.3 us per keyframe.
  [[nodiscard]] std::optional<Matrix6d> between(int from, int to) const;

 private:
  struct Step {
    int to;
    double variance;
    std::size_t motion;
  };

  const std::vector<Pose>& poses_;
  std::vector<std::vector<Step>> steps_;  ///< from each keyframe
  std::vector<Matrix6d> in_world_;        ///< covariance of each motion
};

}  // namespace loopbit::graph
