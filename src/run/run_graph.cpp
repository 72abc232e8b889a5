// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "run_graph.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "loopbit/error.hpp"
#include "loopbit/rigid_motion.hpp"
#include "loopbit/trajectory_error.hpp"

namespace loopbit {
namespace {

using LoopKey = std::pair<PlaceId, PlaceId>;  ///< query and match

/// The loops of a run within itself, after all changes, by query.
std::vector<LateLoop> final_loops(const std::vector<Detection>& detections) {
  std::map<LoopKey, double> similarities;
  for (const Detection& detection : detections) {
    if (detection.match) similarities[{detection.frame, *detection.match}] = detection.similarity;
    for (const LateLoop& loop : detection.late_loops) {
      if (loop.match) similarities[{loop.frame, *loop.match}] = loop.similarity;
    }
  }
  std::vector<LateLoop> loops;
  for (const ReportedMatch& match : with_changes(match_list(detections)).matches) {
    if (!match.is_loop) continue;
    loops.push_back({.frame = match.query,
                     .match = match.match,
                     .score = match.score,
                     .similarity = similarities.at({match.query, match.match})});
  }
  std::ranges::stable_sort(loops, {}, &LateLoop::frame);
  return loops;
}

}  // namespace

RunGraph::RunGraph(const std::vector<Detection>& detections, const std::vector<LoopPose>& poses,
                   const OdometryDrift& drift)
    : frames_(std::ssize(detections)) {
  for (const Detection& detection : detections) {
    if (!detection.odometry) continue;
    graph_.add_frame({0, detection.frame}, detection.timestamp_s, *detection.odometry, drift);
  }
  if (graph_.keyframes().empty()) {
    throw Error(ErrorKind::input,
                "No frame has odometry, so there is no trajectory to correct: give the odometry of "
                "these images, or do not ask to correct it.");
  }
  add_loops(detections, poses);
  graph_.solve();
}

void RunGraph::add_loops(const std::vector<Detection>& detections,
                         const std::vector<LoopPose>& poses) {
  std::map<LoopKey, KnownMotion> known;
  for (const LoopPose& loop : poses) {
    if (loop.match) known[{loop.query, *loop.match}] = known_motion(loop.pose);
  }
  for (const LateLoop& loop : final_loops(detections)) {
    const bool is_judged =
        graph_.add_loop({0, loop.frame}, {0, *loop.match}, known[{loop.frame, *loop.match}]);
    if (is_judged) loops_.push_back(loop);
  }
}

std::vector<LateLoop> RunGraph::rejected() const {
  std::vector<LateLoop> rejected;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    if (graph_.loops()[i].verdict == LoopVerdict::kept) continue;
    rejected.push_back(loops_[i]);
    rejected.back().score = 0;
  }
  return rejected;
}

void RunGraph::write(const std::string& folder) const { graph_.write(folder, {{0, frames_}}); }

Correction RunGraph::results(const std::vector<std::optional<cv::Vec3d>>& positions_m) const {
  Correction results = graph_.results();
  std::vector<cv::Vec3d> truth_m;
  std::vector<cv::Vec3d> odometry_m;
  std::vector<cv::Vec3d> corrected_m;
  const auto& keyframes = graph_.keyframes();
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const auto frame = static_cast<std::size_t>(keyframes[k].at.frame);
    if (frame >= positions_m.size() || !positions_m[frame]) continue;
    truth_m.push_back(*positions_m[frame]);
    odometry_m.push_back(rigid::translation(keyframes[k].T_odometry_camera));
    corrected_m.push_back(rigid::translation(graph_.corrected(k)));
  }
  if (truth_m.size() < 3) return results;
  results.odometry_error_m = absolute_trajectory_error_m(odometry_m, truth_m);
  results.corrected_error_m = absolute_trajectory_error_m(corrected_m, truth_m);
  return results;
}

}  // namespace loopbit
