// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "loopbit/ground_truth.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/odometry.hpp"
#include "loopbit/trajectory.hpp"

namespace loopbit {

/// The odometry of a run's frames, from a file that read_trajectory() reads: poses of the camera.
class OdometryFile {
 public:
  /// `frames`: expected; `first`: a usable one. If the file has times, each frame gets the pose
  /// that is nearest in time, if one is at most 0.05 s away. Otherwise frame k gets row k * every.
  /// Throws Error (kind input) if the file is malformed, its times go back or end before the first
  /// frame, it has times and the frames have none, or it has too few rows.
  OdometryFile(const std::string& path, const FramesRead& frames, const Frame& first);

  /// For each frame, in order. None: it has no odometry. A covariance of the file is then of the
  /// motion since the last frame with odometry.
  std::optional<OdometryPose> next(const Frame& frame);

  /// Throws Error (kind input) if no frame had odometry.
  void check_used() const;

 private:
  [[nodiscard]] std::optional<std::size_t> row_of(const Frame& frame) const;
  [[nodiscard]] cv::Matx66d covariance_between(std::size_t from, std::size_t to) const;

  std::string path_;
  std::size_t every_;
  Trajectory trajectory_;
  std::optional<RowsByTime> by_time_;
  std::size_t frames_ = 0;
  std::optional<std::size_t> last_row_;  ///< of a frame
};

}  // namespace loopbit
