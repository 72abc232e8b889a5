// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include "graph_data.hpp"

namespace loopbit::graph {

/// A motion between two keyframes with one weight each for its rotation and its translation:
/// inverse variances, or less for motions that are trusted less.
struct WeighedMotion {
  int from = 0;
  int to = 0;
  Pose T_from_to = kIdentity;
  double rotation_weight = 0;
  double position_weight = 0;
};

/// Poses to begin a solution with, from `motions` alone: first the rotations, of which nothing but
/// the orthogonality is neglected (chordal relaxation; Martinec and Pajdla 2007, Carlone et al.
/// 2015), then the positions. Both are linear, so that no estimate is needed, and drift of any size
/// does no harm. `fixed`: keyframes that are identities, at least one for each part of the graph
/// that nothing else joins.
std::vector<Pose> relaxed_poses(int count, std::span<const WeighedMotion> motions,
                                std::span<const int> fixed);

}  // namespace loopbit::graph
