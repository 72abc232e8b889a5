// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/detection.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/loop_graph.hpp"
#include "loopbit/odometry.hpp"
#include "loopbit/run_record.hpp"

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

  /// Writes trajectory.csv, corrected.tum, judged_loops.csv and graph.g2o, and corrected.kitti if
  /// all frames have odometry; see docs/run_folder.md. Throws Error (kind output).
  void write(const std::string& folder) const;

  /// `positions_m`: true ones, one per frame; empty = not known.
  [[nodiscard]] Correction results(const std::vector<std::optional<cv::Vec3d>>& positions_m) const;

 private:
  struct Keyframe {
    PlaceId frame = 0;
    std::optional<double> time_s;
    cv::Matx44d T_odometry_camera;  ///< as odometry has it
  };

  void add_keyframe(const Detection& detection, const OdometryDrift& drift);
  void add_loops(const std::vector<Detection>& detections, const std::vector<LoopPose>& poses);
  [[nodiscard]] cv::Matx44d corrected(std::size_t keyframe) const;
  [[nodiscard]] std::string trajectory_rows() const;
  [[nodiscard]] std::string loop_rows() const;

  LoopGraph graph_;
  std::vector<Keyframe> keyframes_;
  std::vector<std::optional<int>> keyframe_of_;  ///< by frame
  std::vector<LateLoop> loops_;                  ///< of the graph's loops, by their numbers
  int unjudged_ = 0;
};

/// The headers of trajectory.csv and judged_loops.csv, without a line end.
inline constexpr const char* kTrajectoryHeader =
    "frame,keyframe,odometry_x_m,odometry_y_m,odometry_z_m,x_m,y_m,z_m";
inline constexpr const char* kJudgedLoopsHeader =
    "query,match,verdict,known,odometry_chi2,compared,agreeing,chi2,limit";

}  // namespace loopbit
