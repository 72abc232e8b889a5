// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "path_covariance.hpp"

#include <cstddef>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace loopbit::graph {

PathCovariance::PathCovariance(const std::vector<Pose>& poses, std::span<const WideLoop> motions)
    : poses_(poses), steps_(poses.size()) {
  // How far a rotation counts: any value gives a bound.
  constexpr double kLever_m = 30;
  in_world_.reserve(motions.size());
  for (const WideLoop& motion : motions) {
    const Matrix6d carry = adjoint(poses[static_cast<std::size_t>(motion.query)]);
    const double variance =
        motion.covariance.topLeftCorner<3, 3>().trace() +
        kLever_m * kLever_m * motion.covariance.bottomRightCorner<3, 3>().trace();
    const std::size_t number = in_world_.size();
    steps_[static_cast<std::size_t>(motion.match)].push_back({motion.query, variance, number});
    steps_[static_cast<std::size_t>(motion.query)].push_back({motion.match, variance, number});
    in_world_.emplace_back(carried(carry, motion.covariance));
  }
}

std::optional<Matrix6d> PathCovariance::between(int from, int to) const {
  struct Reached {
    double variance = std::numeric_limits<double>::infinity();
    int before = -1;
    std::size_t motion = 0;
  };
  std::vector<Reached> reached(poses_.size());
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  reached[static_cast<std::size_t>(from)].variance = 0;
  queue.emplace(0, from);
  while (!queue.empty() && queue.top().second != to) {
    const auto [variance, at] = queue.top();
    queue.pop();
    if (variance > reached[static_cast<std::size_t>(at)].variance) continue;
    for (const Step& step : steps_[static_cast<std::size_t>(at)]) {
      Reached& next = reached[static_cast<std::size_t>(step.to)];
      if (variance + step.variance >= next.variance) continue;
      next = {variance + step.variance, at, step.motion};
      queue.emplace(next.variance, step.to);
    }
  }
  if (queue.empty()) return std::nullopt;
  Matrix6d sum = Matrix6d::Zero();
  for (int at = to; at != from; at = reached[static_cast<std::size_t>(at)].before) {
    sum += in_world_[reached[static_cast<std::size_t>(at)].motion];
  }
  const Matrix6d carry = adjoint(inverse(poses_[static_cast<std::size_t>(to)]));
  return carried(carry, sum);
}

}  // namespace loopbit::graph
