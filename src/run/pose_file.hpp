// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <deque>
#include <fstream>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "loopbit/camera.hpp"
#include "loopbit/detection.hpp"
#include "loopbit/finished_run.hpp"
#include "loopbit/loop_detector.hpp"
#include "loopbit/odometry.hpp"
#include "loopbit/relative_pose.hpp"

#include "depth_folder.hpp"
#include "right_images.hpp"

namespace loopbit {

/// What gives translations a length; the first that is there is used. Without any, odometry does.
struct LengthSources {
  std::optional<DepthFolder> depth;
  std::optional<RightImages> right;
};

/// Writes relative_poses.csv, one row per loop, and what is known of it as relative_poses.g2o and
/// matched_poses.tum; see docs/run_folder.md.
class PoseFile {
 public:
  /// `camera`: of all images, with their size. Throws Error (kind output).
  PoseFile(const std::string& folder, const CameraModel& camera, LengthSources lengths);

  /// Measures the poses of its loops, also late ones, and hands the lines to the system. `detector`
  /// has the features of both frames. With odometry, and without depth and right images, the
  /// nearest frames before and after a match that are 0.5 m away from it give a length. Loops
  /// between images of different shapes are left out: they cannot be from one camera. Returns those
  /// of poses() that are new, valid until the next call. Throws Error (kind output), and what
  /// features_of() throws.
  std::span<const LoopPose> add(const Detection& detection, const LoopDetector& detector);

  /// All that were measured so far, without their inliers.
  [[nodiscard]] const std::vector<LoopPose>& poses() const { return poses_; }

 private:
  void add_loop(const LateLoop& loop, const LoopDetector& detector);
  /// The views beside a match, and the features that they show.
  struct Beside {
    std::deque<Features> features;
    std::vector<NearbyView> views;
  };
  [[nodiscard]] RelativePose measured(const LateLoop& loop, const Features& query,
                                      const Features& match, const LoopDetector& detector);
  void add_right(const LateLoop& loop, Beside& beside);
  void add_neighbours(const LateLoop& loop, const LoopDetector& detector, Beside& beside) const;
  [[nodiscard]] cv::Mat1f depth_of(const LateLoop& loop) const;
  void add_edge(const LateLoop& loop, const RelativePose& pose);

  class Lines {
   public:
    Lines(const std::string& folder, const char* name);
    void append(const std::string& text);

   private:
    std::string path_;
    std::ofstream stream_;
  };

  /// What a depth or right image is found by.
  struct Shot {
    std::string name;
    std::optional<double> time_s;
  };

  CameraModel camera_;
  LengthSources lengths_;
  OdometryTrack track_;
  bool has_odometry_ = false;  ///< at any frame so far
  std::vector<Shot> shots_;    ///< one per frame
  RelativePoseEstimator estimator_;
  Lines table_;
  Lines graph_;
  Lines matched_;
  std::vector<LoopPose> poses_;
  std::set<PlaceId> vertices_;  ///< frames in graph_
};

}  // namespace loopbit
