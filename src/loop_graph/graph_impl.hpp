// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "loopbit/loop_graph.hpp"

#include "graph_data.hpp"
#include "loop_consistency.hpp"

namespace loopbit {
namespace graph {

/// Throws Error (kind input), see LoopGraph::add_loop().
Edge edge_of(const LoopEdge& loop, const LoopGraphOptions& options);

}  // namespace graph

/// See LoopGraph. Loops have the same number in loops(), edges() and wide_.
class GraphImpl {
 public:
  explicit GraphImpl(const LoopGraphOptions& options);

  int add_keyframe(const std::optional<graph::Edge>& odometry);
  int add_loop(const LoopEdge& loop, const graph::Edge& edge);
  void update();
  void solve();

  [[nodiscard]] const LoopGraphOptions& options() const { return options_; }
  [[nodiscard]] const std::vector<graph::Pose>& poses() const { return poses_; }
  [[nodiscard]] const std::vector<graph::Keyframe>& keyframes() const { return keyframes_; }
  [[nodiscard]] const std::vector<JudgedLoop>& loops() const { return loops_; }
  [[nodiscard]] const std::vector<graph::Edge>& edges() const { return edges_; }
  [[nodiscard]] double cost() const;
  [[nodiscard]] std::vector<int> worlds() const;

  // For files, which have what was solved.
  void set_pose(int keyframe, const graph::Pose& pose);
  void set_verdict(int loop, LoopVerdict verdict);
  void measure_chi2();

 private:
  [[nodiscard]] double chi2(std::size_t loop) const;
  [[nodiscard]] double limit(PoseKnown known) const;

  // The steps of solve().
  void reject_unreachable();
  void reject_inconsistent();
  void start_from_relaxation();
  void reject_improbable();
  void solve_kept();
  bool keep_what_fits();

  // The steps of update().
  bool judge_new_loops();
  bool confirm_waiting_loops();
  void solve_window();
  void solve_whole();

  [[nodiscard]] std::vector<std::size_t> of_verdict(LoopVerdict verdict) const;
  /// A keyframe of each part that neither odometry nor kept loops join.
  [[nodiscard]] std::vector<int> roots() const;

  LoopGraphOptions options_;
  std::vector<graph::Keyframe> keyframes_;
  std::vector<graph::Pose> poses_;
  std::vector<JudgedLoop> loops_;
  std::vector<graph::Edge> edges_;     ///< of loops
  std::vector<graph::WideLoop> wide_;  ///< of loops
  std::vector<bool> is_supported_;     ///< by other loops, in solve()
  std::size_t judged_ = 0;             ///< loops that update() has seen
  int last_kept_query_ = 0;            ///< where update() solved loops last
};

/// Has no code of its own: being part of a public class, it would be visible.
class LoopGraph::Impl final : public GraphImpl {
 public:
  using GraphImpl::GraphImpl;
};

}  // namespace loopbit
