// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/detection.hpp"
#include "loopbit/known_motion.hpp"
#include "loopbit/loop_graph.hpp"
#include "loopbit/odometry.hpp"
#include "loopbit/run_record.hpp"

namespace loopbit {

/// The pose graph of one or more sessions: their frames with odometry are the keyframes, their
/// loops the edges. Session 0 is that of a run; only sessions of a map are named in files.
class SessionGraph {
 public:
  struct Keyframe {
    SessionFrame at;
    std::optional<double> time_s;
    cv::Matx44d T_odometry_camera;  ///< as odometry has it
  };

  /// Adds the next frame that has odometry. All frames of a session come in one piece.
  void add_frame(const SessionFrame& at, std::optional<double> time_s, const OdometryPose& odometry,
                 const OdometryDrift& drift = {});

  /// Adds a loop; `motion` is from match to query. False if the loop is not judged, because
  /// one of the two has no odometry or they are one frame.
  bool add_loop(const SessionFrame& query, const SessionFrame& match, const KnownMotion& motion);

  void solve();

  [[nodiscard]] const std::vector<Keyframe>& keyframes() const { return keyframes_; }

  /// In the order in which they were added, without those that are not judged.
  [[nodiscard]] const std::vector<JudgedLoop>& loops() const { return graph_.loops(); }

  /// In the frame of the odometry of its world, from its first pose on.
  [[nodiscard]] cv::Matx44d corrected(std::size_t keyframe) const;

  /// The first session that loops join a keyframe's session to.
  [[nodiscard]] int world_of(std::size_t keyframe) const;

  /// Without errors of the trajectory.
  [[nodiscard]] Correction results() const;

  /// Writes trajectory.csv, corrected.tum, judged_loops.csv and graph.g2o, and corrected.kitti if
  /// all frames of a session have odometry; see docs/run_folder.md. `frames`: their number, by
  /// session. Throws Error (kind output).
  void write(const std::string& folder, const std::map<int, std::int64_t>& frames) const;

 private:
  [[nodiscard]] std::string trajectory_rows() const;
  [[nodiscard]] std::string loop_rows() const;

  LoopGraph graph_;
  std::vector<Keyframe> keyframes_;
  std::map<std::pair<int, int>, int> keyframe_of_;  ///< by session and frame
  std::vector<int> worlds_;                         ///< after solve()
  int unjudged_ = 0;
};

/// The headers of trajectory.csv and judged_loops.csv, without a line end.
inline constexpr const char* kTrajectoryHeader =
    "frame,keyframe,odometry_x_m,odometry_y_m,odometry_z_m,x_m,y_m,z_m";
inline constexpr const char* kJudgedLoopsHeader =
    "query,match,verdict,known,odometry_chi2,compared,agreeing,chi2,limit";

}  // namespace loopbit
