// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "recording_messages.hpp"

namespace loopbit::recordings {

/// The poses of a recording's camera by odometry.
class RecordedMotion {
 public:
  /// Reads `odometry_topic`, and from /tf_static and /tf where the camera of the images on `topic`
  /// is on the robot. Of the frames of TF, those from the camera up to `odom` count, or up to the
  /// root without such a frame. A pose without a child frame is that of the camera. Throws Error:
  /// kind option if there is no such topic or it has no odometry; kind input if a message is
  /// damaged, the place of the camera is not known, or the odometry ends before the images begin.
  RecordedMotion(const Recording& recording, const std::string& odometry_topic,
                 const std::string& topic);

  /// x_odometry = T_odometry_camera x_camera, in metres: the pose nearest in time, if one is at
  /// most 0.05 s away.
  [[nodiscard]] std::optional<cv::Matx44d> at(double time_s) const;

  [[nodiscard]] double first_s() const { return poses_.front().first; }
  [[nodiscard]] double last_s() const { return poses_.back().first; }

 private:
  std::vector<std::pair<double, cv::Matx44d>> poses_;  ///< in order of time
};

}  // namespace loopbit::recordings
