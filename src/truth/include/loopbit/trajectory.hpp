// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

namespace loopbit {

/// Poses of a camera, one per row of a file.
struct Trajectory {
  std::vector<double> times_s;  ///< empty if the file has none
  /// x_world = T_world_camera x_camera, in metres. Rotations are exact, whatever was rounded.
  std::vector<cv::Matx44d> T_world_camera;
  /// Of the motion since the row before, as Motion has it; empty if the file has none.
  std::vector<cv::Matx66d> covariances;
};

/// Reads a trajectory, one pose per row: KITTI poses (12 numbers: camera to world, 3 x 4), a TUM
/// trajectory (8 numbers: time, position, quaternion x y z w), a TUM trajectory with covariances
/// (29: the same, and the upper triangle of a 6 x 6 covariance, row by row) or EuRoC states (17:
/// time in ns, position, quaternion w x y z, 9 that are not read; of the body, not of the camera).
/// All rows have one kind. Numbers are separated by spaces or commas; `#` begins a comment, and one
/// row before all others may name the columns. Throws Error (kind input) with file and line.
Trajectory read_trajectory(const std::string& path);

/// Finds rows by their time.
class RowsByTime {
 public:
  static constexpr double kMaxDelay_s = 0.05;

  /// In any order, and not empty.
  explicit RowsByTime(const std::vector<double>& times_s);

  /// The row nearest to `time_s`, if one is at most kMaxDelay_s away. Of two equally near, the
  /// earlier; of equal times, the first row.
  [[nodiscard]] std::optional<std::size_t> nearest(double time_s) const;

  [[nodiscard]] double first_s() const { return rows_.front().first; }
  [[nodiscard]] double last_s() const { return rows_.back().first; }

 private:
  std::vector<std::pair<double, std::size_t>> rows_;  ///< in order
};

}  // namespace loopbit
