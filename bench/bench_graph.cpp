// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
/// bench_graph [SEEDS]: how well LoopGraph tells right loops from wrong ones in synthetic drives,
/// beside a plain least-squares graph and one with a Huber loss, and how long it takes.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <vector>

#include <fmt/format.h>

#include "loopbit/loop_graph.hpp"
#include "loopbit/median.hpp"

#include "graph_impl.hpp"
#include "pose_problem.hpp"
#include "synthetic_graph.hpp"

namespace loopbit::bench {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Sums over drives.
struct Outcome {
  int wrong = 0;
  int wrong_kept = 0;
  int right = 0;
  int right_lost = 0;
  std::vector<double> error_shares;  ///< error of the trajectory, as a share of that of odometry

  void add(const SyntheticGraph& drive, const std::vector<bool>& is_kept,
           const std::vector<cv::Matx44d>& poses) {
    for (std::size_t i = 0; i < drive.loops.size(); ++i) {
      (drive.is_right[i] ? right : wrong) += 1;
      wrong_kept += !drive.is_right[i] && is_kept[i] ? 1 : 0;
      right_lost += drive.is_right[i] && !is_kept[i] ? 1 : 0;
    }
    error_shares.push_back(trajectory_error_m(poses, drive) /
                           trajectory_error_m(dead_reckoning(drive), drive));
  }
  [[nodiscard]] double wrong_share() const {
    return wrong == 0 ? 0 : static_cast<double>(wrong_kept) / wrong;
  }
  [[nodiscard]] double lost_share() const { return static_cast<double>(right_lost) / right; }
};

LoopGraph graph_of(const SyntheticGraph& drive) {
  LoopGraph graph;
  graph.add_keyframe();
  for (const Motion& motion : drive.odometry) graph.add_keyframe(motion);
  for (const LoopEdge& loop : drive.loops) graph.add_loop(loop);
  return graph;
}

void add_robust(const SyntheticGraph& drive, Outcome& outcome) {
  LoopGraph graph = graph_of(drive);
  graph.solve();
  std::vector<bool> is_kept;
  std::vector<cv::Matx44d> poses;
  for (const JudgedLoop& loop : graph.loops()) {
    is_kept.push_back(loop.verdict == LoopVerdict::kept);
  }
  for (int k = 0; k < graph.size(); ++k) poses.push_back(graph.pose(k));
  outcome.add(drive, is_kept, poses);
}

/// Least squares over all loops, with Huber's weights or all the same. Kept are those whose
/// residual is within the limit that LoopGraph has, too.
void add_plain(const SyntheticGraph& drive, bool huber, Outcome& outcome) {
  constexpr double kHuber = 1.345;
  constexpr int kRounds = 10;
  const LoopGraphOptions options;
  std::vector<graph::Edge> edges;
  std::vector<graph::Pose> poses;
  for (const LoopEdge& loop : drive.loops) edges.push_back(graph::edge_of(loop, options));
  for (const cv::Matx44d& pose : dead_reckoning(drive)) poses.push_back(graph::pose_of(pose));
  graph::PoseProblem problem(poses, options.seen_within_m);
  for (const graph::Edge& edge : edges) problem.add(edge);
  for (std::size_t k = 0; k < drive.odometry.size(); ++k) {
    const int from = static_cast<int>(k);
    const Motion& motion = drive.odometry[k];
    problem.add({from, from + 1, PoseKnown::metric, graph::pose_of(motion.T_from_to),
                 graph::eigen_of(motion.covariance).inverse()});
  }
  problem.fix(0);
  const auto chi2 = [&](std::size_t i) {
    return graph::chi2_of(edges[i], poses[static_cast<std::size_t>(edges[i].from)],
                          poses[static_cast<std::size_t>(edges[i].to)], options.seen_within_m);
  };
  problem.solve(100);
  for (int round = 0; huber && round < kRounds; ++round) {
    for (std::size_t i = 0; i < edges.size(); ++i) {
      problem.set_weight(i, std::min(1.0, kHuber / std::sqrt(std::max(chi2(i), 1e-12))));
    }
    problem.solve(20);
  }
  std::vector<bool> is_kept;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    is_kept.push_back(chi2(i) <= graph::chi2_limit(options.confidence, 6));
  }
  std::vector<cv::Matx44d> solved;
  for (const graph::Pose& pose : poses) solved.push_back(graph::matrix_of(pose));
  outcome.add(drive, is_kept, solved);
}

void print(const char* name, double share, const Outcome& outcome) {
  fmt::print("{:14} {:5.0f} % {:12.3f} {:12.3f} {:12.3f}\n", name, 100 * share,
             outcome.wrong_share(), outcome.lost_share(), median(outcome.error_shares));
}

/// The outcome of LoopGraph with 30 % wrong loops.
Outcome judge_injected(int seeds) {
  fmt::print("1,000 keyframes, {} drives\n{:14} {:>7} {:>12} {:>12} {:>12}\n", seeds, "graph",
             "wrong", "wrong kept", "right lost", "error");
  Outcome at_30;
  for (const double share : {0.0, 0.1, 0.3, 0.5}) {
    Outcome robust;
    Outcome plain;
    Outcome huber;
    for (int seed = 1; seed <= seeds; ++seed) {
      const SyntheticGraph drive = make_synthetic_graph({.keyframes = 1000,
                                                         .loops = 200,
                                                         .wrong_share = share,
                                                         .blocks = 5,
                                                         .seed = static_cast<std::uint64_t>(seed)});
      add_robust(drive, robust);
      add_plain(drive, false, plain);
      add_plain(drive, true, huber);
    }
    print("LoopGraph", share, robust);
    print("least squares", share, plain);
    print("Huber", share, huber);
    if (share == 0.3) at_30 = robust;
  }
  return at_30;
}

/// Seconds of processor time of solve(), which has one thread: others may use the machine.
double time_batch() {
  const SyntheticGraph drive =
      make_synthetic_graph({.keyframes = 10'000, .loops = 4500, .wrong_share = 0.1, .blocks = 13});
  LoopGraph graph = graph_of(drive);
  const std::clock_t begin = std::clock();
  graph.solve();
  const double time_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  int wrong_kept = 0;
  int right_lost = 0;
  for (std::size_t i = 0; i < drive.loops.size(); ++i) {
    const bool is_kept = graph.loops()[i].verdict == LoopVerdict::kept;
    wrong_kept += is_kept && !drive.is_right[i] ? 1 : 0;
    right_lost += !is_kept && drive.is_right[i] ? 1 : 0;
  }
  fmt::print("batch: {} keyframes, {} loops, {} wrong ones kept, {} right ones lost, {:.2f} s\n",
             graph.size(), graph.loops().size(), wrong_kept, right_lost, time_s);
  return time_s;
}

/// Milliseconds of update(), at the median over all keyframes.
double time_steps() {
  const SyntheticGraph drive =
      make_synthetic_graph({.keyframes = 3000, .loops = 1000, .wrong_share = 0.1, .blocks = 10});
  LoopGraph graph;
  graph.add_keyframe();
  std::vector<double> times_ms;
  std::size_t next = 0;
  for (std::size_t k = 1; k <= drive.odometry.size(); ++k) {
    graph.add_keyframe(drive.odometry[k - 1]);
    while (next < drive.loops.size() && drive.loops[next].query == static_cast<int>(k)) {
      graph.add_loop(drive.loops[next++]);
    }
    const auto begin = Clock::now();
    graph.update();
    times_ms.push_back(1000 * seconds_since(begin));
  }
  const double longest = *std::ranges::max_element(times_ms);
  const double middle = median(times_ms);
  fmt::print("driving: {} keyframes, {} loops, {:.2f} ms per step at the median, {:.0f} at most\n",
             graph.size(), graph.loops().size(), middle, longest);
  return middle;
}

}  // namespace
}  // namespace loopbit::bench

int main(int argc, char** argv) {
  using namespace loopbit::bench;
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 10;
  if (seeds < 1) {
    fmt::print(stderr, "usage: bench_graph [SEEDS], at least 1\n");
    return 2;
  }
  const Outcome injected = judge_injected(seeds);
  const double batch_s = time_batch();
  const double step_ms = time_steps();
  fmt::print(
      "graph injected_wrong_kept={:.4f} injected_right_lost={:.4f} batch_s={:.2f} step_ms={:.2f}\n",
      injected.wrong_share(), injected.lost_share(), batch_s, step_ms);
}
