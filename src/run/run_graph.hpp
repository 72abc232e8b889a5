// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/detection.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/odometry.hpp"
#include "loopbit/run_record.hpp"

#include "session_graph.hpp"

namespace loopbit {

/// The pose graph of a run: its frames with odometry are the keyframes, its loops the edges.
class RunGraph {
 public:
  /// Builds the graph and solves it. `detections`: all of the run. `poses`: of its loops; one that
  /// has none says only that both frames see the same place. Loops of frames without odometry, and
  /// those to earlier sessions of a map, are left out. Throws Error (kind input) if no frame has
  /// odometry.
  RunGraph(const std::vector<Detection>& detections, const std::vector<LoopPose>& poses,
           const OdometryDrift& drift);

  /// The loops that the graph rejects, by frame, as withdrawn ones.
  [[nodiscard]] std::vector<LateLoop> rejected() const;

  /// See SessionGraph.
  void write(const std::string& folder) const;

  /// `positions_m`: true ones, one per frame; empty = not known.
  [[nodiscard]] Correction results(const std::vector<std::optional<cv::Vec3d>>& positions_m) const;

 private:
  void add_loops(const std::vector<Detection>& detections, const std::vector<LoopPose>& poses);

  std::int64_t frames_;
  SessionGraph graph_;
  std::vector<LateLoop> loops_;  ///< of the graph's loops, by their numbers
};

}  // namespace loopbit
