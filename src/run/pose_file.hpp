// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <fstream>
#include <string>

#include "loopbit/camera.hpp"
#include "loopbit/detection.hpp"
#include "loopbit/loop_detector.hpp"
#include "loopbit/relative_pose.hpp"

namespace loopbit {

/// Writes relative_poses.csv, one row per loop; see docs/run_folder.md.
class PoseFile {
 public:
  /// `camera`: of all images, with their size. Throws Error (kind output).
  PoseFile(const std::string& folder, const CameraModel& camera);

  /// Measures the poses of its loops, also late ones, and hands the rows to the system. `detector`
  /// has the features of both frames. Loops between images of different shapes are left out: they
  /// cannot be from one camera. Throws Error (kind output), and what features_of() throws.
  void add(const Detection& detection, const LoopDetector& detector);

 private:
  void add_loop(const LateLoop& loop, const LoopDetector& detector);
  void append(const std::string& row);

  std::string path_;
  CameraModel camera_;
  RelativePoseEstimator estimator_;
  std::ofstream stream_;
};

}  // namespace loopbit
