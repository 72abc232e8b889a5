// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loop_consistency.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>
#include <set>
#include <tuple>

namespace loopbit::graph {
namespace {

const Keyframe& at(const std::vector<Keyframe>& keyframes, int keyframe) {
  return keyframes[static_cast<std::size_t>(keyframe)];
}

bool are_joined(const std::vector<Keyframe>& keyframes, const WideLoop& loop) {
  return at(keyframes, loop.match).chain == at(keyframes, loop.query).chain;
}

/// The small motion that is `error`.
Vector6d small_motion(const Pose& error) {
  const double sign = error[6] < 0 ? -2 : 2;
  Vector6d motion;
  motion << error[0], error[1], error[2], sign * error[3], sign * error[4], sign * error[5];
  return motion;
}

double mahalanobis(const Pose& error, const Matrix6d& covariance) {
  return Factors(covariance).mahalanobis_sq(small_motion(error));
}

double position_variance(const Matrix6d& covariance) {
  return covariance.topLeftCorner<3, 3>().trace() / 3;
}

/// The largest variance of a cycle over the loop that is not closed by chance.
double largest_telling_variance(const std::vector<Keyframe>& keyframes, const WideLoop& loop) {
  constexpr double kShare = 0.04;  // one in 125 random loops is as near
  if (!are_joined(keyframes, loop)) return std::numeric_limits<double>::infinity();
  return kShare * position_variance(reckon(keyframes, loop.match, loop.query).covariance);
}

/// How two loops stand to each other.
struct Comparison {
  int other = 0;
  bool agrees = false;
  bool supports = false;
};

/// Of each loop, both ways.
std::vector<std::vector<Comparison>> compare(const std::vector<Keyframe>& keyframes,
                                             std::span<const WideLoop> loops, double limit) {
  constexpr std::size_t kReach = 20;  // to either side
  std::vector<std::size_t> order(loops.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) {
    return std::tuple(at(keyframes, loops[i].query).chain, at(keyframes, loops[i].match).chain,
                      loops[i].query);
  });
  std::vector<double> telling(loops.size());
  std::ranges::transform(loops, telling.begin(), [&](const WideLoop& loop) {
    return largest_telling_variance(keyframes, loop);
  });
  std::vector<std::vector<Comparison>> result(loops.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t end = std::min(order.size(), k + kReach + 1);
    for (std::size_t other = k + 1; other < end; ++other) {
      const std::size_t i = order[k];
      const std::size_t j = order[other];
      if (!are_comparable(keyframes, loops[i], loops[j])) break;
      const Cycle cycle = cycle_of(keyframes, loops[i], loops[j]);
      const bool agree = cycle.chi2 <= limit;
      const double variance = cycle.position_variance_m;
      result[i].push_back({static_cast<int>(j), agree, agree && variance <= telling[i]});
      result[j].push_back({static_cast<int>(i), agree, agree && variance <= telling[j]});
    }
  }
  return result;
}

/// Of two loops that contradict each other, nothing tells which is wrong.
double share(const Agreement& a) {
  return a.compared < 2 ? 1 : static_cast<double>(a.agreeing) / a.compared;
}

}  // namespace

WideLoop wide_loop(const Edge& loop, double seen_within_m) {
  constexpr double kAnyRotation = 1.0;  // rad; the same features are not seen from behind
  WideLoop wide{loop.from, loop.to, loop.measured, Matrix6d::Zero()};
  if (loop.known == PoseKnown::metric) {
    wide.covariance = Factors(loop.information).inverse();
    return wide;
  }
  wide.T_match_query[0] = wide.T_match_query[1] = wide.T_match_query[2] = 0;
  wide.covariance.topLeftCorner<3, 3>().diagonal().setConstant(seen_within_m * seen_within_m);
  if (loop.known == PoseKnown::nothing) {
    std::copy(kIdentity.begin() + 3, kIdentity.end(), wide.T_match_query.begin() + 3);
    wide.covariance.bottomRightCorner<3, 3>().diagonal().setConstant(kAnyRotation * kAnyRotation);
  } else {
    wide.covariance.bottomRightCorner<3, 3>() =
        loop.information.bottomRightCorner<3, 3>().inverse();
  }
  return wide;
}

Reckoned reckon(const std::vector<Keyframe>& keyframes, int from, int to) {
  const Keyframe& a = at(keyframes, from);
  const Keyframe& b = at(keyframes, to);
  const Matrix6d carry = adjoint(inverse(b.reckoned));
  const Matrix6d drift = from < to ? b.drift - a.drift : a.drift - b.drift;
  return {between(a.reckoned, b.reckoned), carried(carry, drift)};
}

std::optional<double> odometry_chi2(const std::vector<Keyframe>& keyframes, const WideLoop& loop) {
  if (!are_joined(keyframes, loop)) return std::nullopt;
  const Reckoned odometry = reckon(keyframes, loop.match, loop.query);
  return loop_chi2(loop, odometry);
}

double loop_chi2(const WideLoop& loop, const Reckoned& known) {
  return mahalanobis(times(inverse(loop.T_match_query), known.T_from_to),
                     loop.covariance + known.covariance);
}

bool are_comparable(const std::vector<Keyframe>& keyframes, const WideLoop& a, const WideLoop& b) {
  return at(keyframes, a.match).chain == at(keyframes, b.match).chain &&
         at(keyframes, a.query).chain == at(keyframes, b.query).chain;
}

Cycle cycle_of(const std::vector<Keyframe>& keyframes, const WideLoop& a, const WideLoop& b) {
  const Reckoned matches = reckon(keyframes, b.match, a.match);
  const Reckoned queries = reckon(keyframes, a.query, b.query);
  // b by way of a: from b's match to that of a, over the loop, and on to b's query. All errors are
  // carried to b's query.
  const Pose way = times(times(matches.T_from_to, a.T_match_query), queries.T_from_to);
  const Matrix6d from_query = adjoint(inverse(queries.T_from_to));
  const Matrix6d from_match = adjoint(inverse(a.T_match_query));
  const Matrix6d covariance =
      b.covariance + queries.covariance +
      carried(from_query, a.covariance + carried(from_match, matches.covariance));
  return {mahalanobis(times(inverse(b.T_match_query), way), covariance),
          position_variance(covariance)};
}

std::vector<Agreement> find_consistent(const std::vector<Keyframe>& keyframes,
                                       std::span<const WideLoop> loops, double limit) {
  constexpr double kLeastShare = 0.5;
  const auto comparisons = compare(keyframes, loops, limit);
  std::vector<Agreement> left(loops.size());
  std::set<std::tuple<double, int, int>> worst_first;  // share, agreeing, loop
  const auto key = [&](int i) {
    const Agreement& a = left[static_cast<std::size_t>(i)];
    return std::tuple(share(a), a.agreeing, i);
  };
  for (std::size_t i = 0; i < loops.size(); ++i) {
    for (const Comparison& comparison : comparisons[i]) {
      ++left[i].compared;
      left[i].agreeing += comparison.agrees ? 1 : 0;
      left[i].supporting += comparison.supports ? 1 : 0;
    }
    worst_first.insert(key(static_cast<int>(i)));
  }
  while (!worst_first.empty() && std::get<0>(*worst_first.begin()) < kLeastShare) {
    const int worst = std::get<2>(*worst_first.begin());
    worst_first.erase(worst_first.begin());
    left[static_cast<std::size_t>(worst)].is_consistent = false;
    for (const Comparison& comparison : comparisons[static_cast<std::size_t>(worst)]) {
      Agreement& neighbour = left[static_cast<std::size_t>(comparison.other)];
      if (!neighbour.is_consistent) continue;
      worst_first.erase(key(comparison.other));
      --neighbour.compared;
      neighbour.agreeing -= comparison.agrees ? 1 : 0;
      neighbour.supporting -= comparison.supports ? 1 : 0;
      worst_first.insert(key(comparison.other));
    }
  }
  return left;
}

}  // namespace loopbit::graph
