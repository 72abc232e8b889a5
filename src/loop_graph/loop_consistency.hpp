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

/// Squared Mahalanobis distance of a loop from what is known of the same motion.
double loop_chi2(const WideLoop& loop, const Reckoned& known);

/// The same from odometry. None if odometry does not connect the two.
std::optional<double> odometry_chi2(const std::vector<Keyframe>& keyframes, const WideLoop& loop);

/// Whether two loops join the same chains, so that they can be compared.
bool are_comparable(const std::vector<Keyframe>& keyframes, const WideLoop& a, const WideLoop& b);

/// The cycle over two loops and the odometry between their ends.
struct Cycle {
  double chi2 = 0;                 ///< squared Mahalanobis distance, 6 degrees of freedom
  double position_variance_m = 0;  ///< per axis, m^2: what the comparison cannot tell
};

/// For comparable loops. Cost: 2 us.
Cycle cycle_of(const std::vector<Keyframe>& keyframes, const WideLoop& a, const WideLoop& b);

/// How a loop stands to those nearby.
struct Agreement {
  int compared = 0;
  int agreeing = 0;
  /// Loops that agree, and would hardly do so by chance: the cycle is known much better than what
  /// odometry alone says of the loop.
  int supporting = 0;
  bool is_consistent = true;
};

/// Compares each loop with up to 40 others whose queries are nearest, and takes out, one by one,
/// the loop with which the smallest share of the others agrees, until at least half of them agree
/// with each. Loops that agree with each other by chance are few; a wrong loop alone stays if there
/// is nothing to compare it with. `limit`: largest pair_chi2() of loops that agree.
std::vector<Agreement> find_consistent(const std::vector<Keyframe>& keyframes,
                                       std::span<const WideLoop> loops, double limit);

}  // namespace loopbit::graph
