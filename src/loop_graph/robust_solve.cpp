// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "robust_solve.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "pose_problem.hpp"

namespace loopbit::graph {
namespace {

/// Squared residuals in units of their limits.
std::vector<double> ratios_of(const std::vector<Pose>& poses, std::span<const Edge> loops,
                              std::span<const double> limits, double seen_within_m) {
  std::vector<double> ratios(loops.size());
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const Pose& from = poses[static_cast<std::size_t>(loops[i].from)];
    const Pose& to = poses[static_cast<std::size_t>(loops[i].to)];
    ratios[i] = chi2_of(loops[i], from, to, seen_within_m) / limits[i];
  }
  return ratios;
}

/// Eq. 14 of the paper; `ratio` is r^2 / c^2.
double weight_of(double ratio, double mu) {
  if (ratio <= mu / (mu + 1)) return 1;
  if (ratio >= (mu + 1) / mu) return 0;
  return std::sqrt(mu * (mu + 1) / ratio) - mu;
}

}  // namespace

RobustSolution solve_robustly(std::vector<Pose>& poses, std::span<const Edge> odometry,
                              std::span<const Edge> loops, std::span<const double> limits,
                              std::span<const int> fixed, double seen_within_m) {
  constexpr int kFirstIterations = 12;
  constexpr int kStepIterations = 1;
  constexpr int kLastIterations = 20;
  constexpr double kMuStep = 4;  // 1.4 in the paper; this takes a quarter of the time
  constexpr double kLeastMu = 1e-5;
  PoseProblem problem(poses, seen_within_m);
  for (const Edge& loop : loops) problem.add(loop);
  for (const Edge& edge : odometry) problem.add(edge);
  for (const int keyframe : fixed) problem.fix(keyframe);
  RobustSolution solution{.is_kept = std::vector<bool>(loops.size(), true)};
  solution.cost = problem.solve(kFirstIterations);
  auto ratios = ratios_of(poses, loops, limits, seen_within_m);
  const double worst = ratios.empty() ? 0 : *std::ranges::max_element(ratios);
  if (worst <= 1) return solution;
  bool is_binary = false;
  for (double mu = std::max(kLeastMu, 1 / (2 * worst - 1)); !is_binary; mu *= kMuStep) {
    is_binary = true;
    for (std::size_t i = 0; i < loops.size(); ++i) {
      const double weight = weight_of(ratios[i], mu);
      is_binary = is_binary && (weight == 0 || weight == 1);
      problem.set_weight(i, weight);
    }
    problem.solve(kStepIterations);
    ratios = ratios_of(poses, loops, limits, seen_within_m);
  }
  // What fits after all is kept, and what does not fit any more is not.
  for (std::size_t i = 0; i < loops.size(); ++i) {
    solution.is_kept[i] = ratios[i] <= 1;
    problem.set_weight(i, solution.is_kept[i] ? 1 : 0);
  }
  solution.cost = problem.solve(kLastIterations);
  return solution;
}

}  // namespace loopbit::graph
