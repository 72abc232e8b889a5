// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "graph_data.hpp"

namespace loopbit::graph {

/// A loop as a motion of six degrees, whatever is known of it: what is not known is wide.
struct WideLoop {
  int match = 0;
  int query = 0;
  Pose T_match_query = kIdentity;
  Matrix6d covariance = Matrix6d::Zero();
};

WideLoop wide_loop(const Edge& loop, double seen_within_m);

/// Odometry from one keyframe to another of the same chain, with its drift; constant time.
struct Reckoned {
  Pose T_from_to = kIdentity;
  Matrix6d covariance = Matrix6d::Zero();  ///< in the frame `to`
};
Reckoned reckon(const std::vector<Keyframe>& keyframes, int from, int to);

/// Squared Mahalanobis distance of a loop from odometry. None if odometry does not connect the two.
std::optional<double> odometry_chi2(const std::vector<Keyframe>& keyframes, const WideLoop& loop);

/// Whether two loops join the same chains, so that they can be compared.
bool are_comparable(const std::vector<Keyframe>& keyframes, const WideLoop& a, const WideLoop& b);

/// Squared Mahalanobis distance of the cycle over two loops and the odometry between their ends: 6
/// degrees of freedom. For comparable loops. Cost: 2 us.
double pair_chi2(const std::vector<Keyframe>& keyframes, const WideLoop& a, const WideLoop& b);

/// How a loop stands to those nearby.
struct Agreement {
  int compared = 0;
  int agreeing = 0;
  bool is_consistent = true;
};

/// Compares each loop with up to 40 others whose queries are nearest, and takes out, one by one,
/// the loop with which the smallest share of the others agrees, until at least half of them agree
/// with each. Loops that agree with each other by chance are few; a wrong loop alone stays if there
/// is nothing to compare it with. `limit`: largest pair_chi2() of loops that agree.
std::vector<Agreement> find_consistent(const std::vector<Keyframe>& keyframes,
                                       std::span<const WideLoop> loops, double limit);

}  // namespace loopbit::graph
