// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "graph_impl.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "path_covariance.hpp"
#include "pose_problem.hpp"
#include "relaxed_poses.hpp"
#include "robust_solve.hpp"

namespace loopbit {
namespace {

using graph::Edge;
using graph::Keyframe;
using graph::Pose;

std::size_t index(int number) { return static_cast<std::size_t>(number); }

/// Sets of numbers that are joined step by step; the smallest number stands for its set.
class Joined {
 public:
  explicit Joined(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int root(int i) {
    while (parent_[index(i)] != i) {
      parent_[index(i)] = parent_[index(parent_[index(i)])];
      i = parent_[index(i)];
    }
    return i;
  }
  void join(int a, int b) {
    const auto [low, high] = std::minmax({root(a), root(b)});
    parent_[index(high)] = low;
  }

 private:
  std::vector<int> parent_;
};

}  // namespace

GraphImpl::GraphImpl(const LoopGraphOptions& options) : options_(options) {
  validate(options, "graph");
}

int GraphImpl::add_keyframe(const std::optional<Edge>& odometry) {
  const int number = static_cast<int>(keyframes_.size());
  Keyframe keyframe{.chain = number, .odometry = odometry};
  Pose pose = graph::kIdentity;
  if (odometry) {
    const Keyframe& before = keyframes_.back();
    keyframe.chain = before.chain;
    keyframe.reckoned = graph::times(before.reckoned, odometry->measured);
    const graph::Matrix6d carry = graph::adjoint(keyframe.reckoned);
    keyframe.drift =
        before.drift + graph::carried(carry, graph::Factors(odometry->information).inverse());
    pose = graph::times(poses_.back(), odometry->measured);
  }
  keyframes_.push_back(keyframe);
  poses_.push_back(pose);
  return number;
}

int GraphImpl::add_loop(const LoopEdge& loop, const Edge& edge) {
  edges_.push_back(edge);
  wide_.push_back(graph::wide_loop(edge, options_.seen_within_m));
  loops_.push_back({.edge = loop, .limit = limit(edge.known)});
  loops_.back().odometry_chi2 = graph::odometry_chi2(keyframes_, wide_.back());
  return static_cast<int>(loops_.size()) - 1;
}

double GraphImpl::limit(PoseKnown known) const {
  return graph::chi2_limit(options_.confidence, graph::freedom_of(known));
}

double GraphImpl::chi2(std::size_t loop) const {
  const Edge& edge = edges_[loop];
  return graph::chi2_of(edge, poses_[index(edge.from)], poses_[index(edge.to)],
                        options_.seen_within_m);
}

void GraphImpl::measure_chi2() {
  for (std::size_t i = 0; i < loops_.size(); ++i) loops_[i].chi2 = chi2(i);
}

double GraphImpl::cost() const {
  double sum = 0;
  for (const Keyframe& keyframe : keyframes_) {
    if (!keyframe.odometry) continue;
    const Edge& edge = *keyframe.odometry;
    sum += graph::chi2_of(edge, poses_[index(edge.from)], poses_[index(edge.to)],
                          options_.seen_within_m);
  }
  for (const std::size_t i : of_verdict(LoopVerdict::kept)) sum += chi2(i);
  return sum / 2;
}

std::vector<std::size_t> GraphImpl::of_verdict(LoopVerdict verdict) const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    if (loops_[i].verdict == verdict) found.push_back(i);
  }
  return found;
}

void GraphImpl::solve() {
  // What odometry alone makes impossible.
  reject_unreachable();
  // What most loops nearby contradict.
  reject_inconsistent();
  // What loops that support each other make impossible; everything else with a robust loss.
  start_from_relaxation();
  reject_improbable();
  solve_kept();
  // Of loops that only others or odometry contradicted, those that fit, and what they bring near.
  while (keep_what_fits()) solve_whole();
  measure_chi2();
  judged_ = loops_.size();
  for (const std::size_t i : of_verdict(LoopVerdict::kept)) {
    last_kept_query_ = std::max(last_kept_query_, edges_[i].to);
  }
}

void GraphImpl::reject_unreachable() {
  const double limit = graph::chi2_limit(options_.confidence, 6);
  for (JudgedLoop& loop : loops_) {
    const bool is_reachable = loop.odometry_chi2.value_or(0) <= limit;
    loop.verdict = is_reachable ? LoopVerdict::kept : LoopVerdict::unreachable;
  }
}

void GraphImpl::reject_inconsistent() {
  constexpr int kSupport = 2;
  const std::vector<std::size_t> reachable = of_verdict(LoopVerdict::kept);
  is_supported_.assign(loops_.size(), false);
  std::vector<graph::WideLoop> wide;
  wide.reserve(reachable.size());
  for (const std::size_t i : reachable) wide.push_back(wide_[i]);
  const auto agreements =
      graph::find_consistent(keyframes_, wide, graph::chi2_limit(options_.confidence, 6));
  for (std::size_t k = 0; k < reachable.size(); ++k) {
    JudgedLoop& loop = loops_[reachable[k]];
    loop.compared = agreements[k].compared;
    loop.agreeing = agreements[k].agreeing;
    is_supported_[reachable[k]] = agreements[k].supporting >= kSupport;
    if (!agreements[k].is_consistent) loop.verdict = LoopVerdict::inconsistent;
  }
}

void GraphImpl::start_from_relaxation() {
  // A loop that no other supports must not bend the graph yet, but may be all that joins its parts.
  constexpr double kUnsupported = 1e-6;
  std::vector<graph::WeighedMotion> motions;
  const auto add = [&](int from, int to, const Pose& motion, const graph::Matrix6d& covariance,
                       double trust) {
    motions.push_back({from, to, motion, trust * 3 / covariance.bottomRightCorner<3, 3>().trace(),
                       trust * 3 / covariance.topLeftCorner<3, 3>().trace()});
  };
  for (const Keyframe& keyframe : keyframes_) {
    if (!keyframe.odometry) continue;
    const Edge& edge = *keyframe.odometry;
    add(edge.from, edge.to, edge.measured, graph::Factors(edge.information).inverse(), 1);
  }
  for (const std::size_t i : of_verdict(LoopVerdict::kept)) {
    const graph::WideLoop& loop = wide_[i];
    add(loop.match, loop.query, loop.T_match_query, loop.covariance,
        is_supported_[i] ? 1 : kUnsupported);
  }
  poses_ = graph::relaxed_poses(static_cast<int>(keyframes_.size()), motions, roots());
}

/// Solves the loops that others support, and tests the others against that solution: as
/// reject_unreachable() does, but drift counts only to the nearest loops.
void GraphImpl::reject_improbable() {
  constexpr int kIterations = 12;
  const std::vector<std::size_t> kept = of_verdict(LoopVerdict::kept);
  const auto is_supported = [&](std::size_t i) { return is_supported_[i]; };
  if (std::ranges::none_of(kept, is_supported) || std::ranges::all_of(kept, is_supported)) return;
  graph::PoseProblem problem(poses_, options_.seen_within_m);
  std::vector<graph::WideLoop> motions;
  for (const Keyframe& keyframe : keyframes_) {
    if (!keyframe.odometry) continue;
    problem.add(*keyframe.odometry);
    motions.push_back(graph::wide_loop(*keyframe.odometry, options_.seen_within_m));
  }
  for (const std::size_t i : kept) {
    if (!is_supported_[i]) continue;
    problem.add(edges_[i]);
    motions.push_back(wide_[i]);
  }
  for (const Keyframe& keyframe : keyframes_) {
    if (!keyframe.odometry) problem.fix(keyframe.chain);
  }
  problem.solve(kIterations);
  const graph::PathCovariance known(poses_, motions);
  const double limit = graph::chi2_limit(options_.confidence, 6);
  for (const std::size_t i : kept) {
    const graph::WideLoop& loop = wide_[i];
    if (is_supported_[i] || chi2(i) <= loops_[i].limit) continue;
    const auto covariance = known.between(loop.match, loop.query);
    if (!covariance) continue;
    const Pose motion = graph::between(poses_[index(loop.match)], poses_[index(loop.query)]);
    if (graph::loop_chi2(loop, {motion, *covariance}) > limit)
      loops_[i].verdict = LoopVerdict::outlier;
  }
}

std::vector<int> GraphImpl::worlds() const {
  Joined joined(keyframes_.size());
  for (const Keyframe& keyframe : keyframes_) {
    if (keyframe.odometry) joined.join(keyframe.odometry->from, keyframe.odometry->to);
  }
  for (const std::size_t i : of_verdict(LoopVerdict::kept)) {
    joined.join(edges_[i].from, edges_[i].to);
  }
  std::vector<int> found(keyframes_.size());
  for (std::size_t i = 0; i < found.size(); ++i) found[i] = joined.root(static_cast<int>(i));
  return found;
}

std::vector<int> GraphImpl::roots() const {
  std::vector<int> found = worlds();
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

void GraphImpl::solve_kept() {
  const std::vector<std::size_t> kept = of_verdict(LoopVerdict::kept);
  std::vector<Edge> odometry;
  std::vector<Edge> loops;
  std::vector<double> limits;
  for (const Keyframe& keyframe : keyframes_) {
    if (keyframe.odometry) odometry.push_back(*keyframe.odometry);
  }
  for (const std::size_t i : kept) {
    loops.push_back(edges_[i]);
    limits.push_back(loops_[i].limit);
  }
  const auto solution =
      graph::solve_robustly(poses_, odometry, loops, limits, roots(), options_.seen_within_m);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (!solution.is_kept[k]) loops_[kept[k]].verdict = LoopVerdict::outlier;
  }
}

/// Odometry may have drifted further than it hardly ever does. That other loops moved the poses to
/// where such a loop puts them is no accident if it is metric; anything less fits a place nearby.
/// Whether there is any.
bool GraphImpl::keep_what_fits() {
  bool any = false;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    JudgedLoop& loop = loops_[i];
    const bool may_fit =
        loop.verdict == LoopVerdict::inconsistent ||
        (loop.verdict == LoopVerdict::unreachable && loop.edge.known == PoseKnown::metric);
    if (!may_fit || chi2(i) > loop.limit) continue;
    loop.verdict = LoopVerdict::kept;
    any = true;
  }
  return any;
}

void GraphImpl::update() {
  const bool is_new = judged_ < loops_.size();
  const bool bends = judge_new_loops();
  if (is_new) solve_window();
  // If the latest keyframes cannot follow, all have to.
  bool is_strained = bends;
  for (std::size_t i = judged_; i < loops_.size(); ++i) {
    is_strained =
        is_strained || (loops_[i].verdict == LoopVerdict::kept && chi2(i) > loops_[i].limit);
  }
  if (is_strained && is_new) {
    // Chains that nothing joined have to be moved first.
    const bool joins = std::any_of(
        loops_.begin() + static_cast<std::ptrdiff_t>(judged_), loops_.end(),
        [](const auto& loop) { return loop.verdict == LoopVerdict::kept && !loop.odometry_chi2; });
    joins ? solve() : solve_whole();
  }
  for (std::size_t i = judged_; i < loops_.size(); ++i) {
    loops_[i].chi2 = chi2(i);
    if (loops_[i].verdict == LoopVerdict::kept)
      last_kept_query_ = static_cast<int>(poses_.size()) - 1;
  }
  judged_ = loops_.size();
}

/// Whether kept loops contradict the estimate.
bool GraphImpl::judge_new_loops() {
  const double limit = graph::chi2_limit(options_.confidence, 6);
  bool waits = false;
  for (std::size_t i = judged_; i < loops_.size(); ++i) {
    JudgedLoop& loop = loops_[i];
    if (loop.odometry_chi2.value_or(0) > limit) {
      loop.verdict = LoopVerdict::unreachable;
    } else if (chi2(i) <= loop.limit) {
      loop.verdict = LoopVerdict::kept;
    } else {
      waits = true;
    }
  }
  return waits && confirm_waiting_loops();
}

/// Keeps new loops that contradict the estimate if an earlier one that waits agrees with them.
bool GraphImpl::confirm_waiting_loops() {
  constexpr std::size_t kReach = 20;
  const double limit = graph::chi2_limit(options_.confidence, 6);
  const std::size_t begin = judged_ < kReach ? 0 : judged_ - kReach;
  bool any = false;
  for (std::size_t i = judged_; i < loops_.size(); ++i) {
    if (loops_[i].verdict != LoopVerdict::undecided) continue;
    for (std::size_t other = begin; other < i; ++other) {
      const LoopVerdict verdict = loops_[other].verdict;
      if (verdict != LoopVerdict::undecided && verdict != LoopVerdict::kept) continue;
      if (!graph::are_comparable(keyframes_, wide_[i], wide_[other])) continue;
      ++loops_[i].compared;
      if (graph::cycle_of(keyframes_, wide_[other], wide_[i]).chi2 > limit) continue;
      ++loops_[i].agreeing;
      any = any || verdict == LoopVerdict::undecided;
      loops_[other].verdict = loops_[i].verdict = LoopVerdict::kept;
    }
  }
  return any;
}

void GraphImpl::solve_window() {
  constexpr int kIterations = 5;
  const int end = static_cast<int>(poses_.size());
  const int begin = std::max(0, std::min(end - options_.window, last_kept_query_));
  graph::PoseProblem problem(poses_, options_.seen_within_m);
  for (int i = begin + 1; i < end; ++i) {
    const auto& odometry = keyframes_[index(i)].odometry;
    if (odometry) problem.add(*odometry);
  }
  for (std::size_t i = loops_.size(); i-- > 0;) {
    const Edge& edge = edges_[i];
    if (std::max(edge.from, edge.to) <= begin) {
      // Loops come in the order of their queries.
      if (i < judged_) break;
      continue;
    }
    if (loops_[i].verdict != LoopVerdict::kept) continue;
    problem.add(edge);
    if (std::min(edge.from, edge.to) <= begin) problem.fix(std::min(edge.from, edge.to));
  }
  problem.fix(begin);
  problem.solve(kIterations);
}

void GraphImpl::solve_whole() {
  constexpr int kIterations = 10;
  const auto solve_once = [&] {
    graph::PoseProblem problem(poses_, options_.seen_within_m);
    for (const Keyframe& keyframe : keyframes_) {
      if (keyframe.odometry) problem.add(*keyframe.odometry);
    }
    for (const std::size_t i : of_verdict(LoopVerdict::kept)) problem.add(edges_[i]);
    for (const int keyframe : roots()) problem.fix(keyframe);
    problem.solve(kIterations);
  };
  solve_once();
  bool any = false;
  for (const std::size_t i : of_verdict(LoopVerdict::kept)) {
    if (chi2(i) <= loops_[i].limit) continue;
    loops_[i].verdict = LoopVerdict::outlier;
    any = true;
  }
  if (any) solve_once();
}

void GraphImpl::set_pose(int keyframe, const Pose& pose) { poses_[index(keyframe)] = pose; }

void GraphImpl::set_verdict(int loop, LoopVerdict verdict) {
  loops_[index(loop)].verdict = verdict;
}

}  // namespace loopbit
