// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "recording_file.hpp"

namespace loopbit::recordings {

/// Where a frame of a robot is in its parent, at a time.
struct TimedTransform {
  double time_s = 0;
  std::string parent;
  std::string child;  ///< empty if the message does not name it
  cv::Matx44d T_parent_child;
};

/// The name of a frame, without the `/` that it may begin with in ROS 1.
std::string without_slash(std::string frame);

/// Whether read_transforms() reads the messages of such a channel: nav_msgs Odometry, tf2_msgs
/// TFMessage, or geometry_msgs PoseStamped, PoseWithCovarianceStamped or TransformStamped, of ROS 1
/// or ROS 2.
bool is_motion(const Channel& channel);

/// Reads a message of a channel that is_motion(). Names of frames are without_slash(). Throws Error
/// (kind input) if it is cut off, a number is not finite, or a rotation is no unit quaternion;
/// `thing` begins the sentence.
std::vector<TimedTransform> read_transforms(const Channel& channel, Bytes message,
                                            const std::string& thing);

/// Whether read_camera_info() reads the messages of such a channel.
bool is_camera_info(const Channel& channel);

/// A sensor_msgs CameraInfo as the YAML that ROS' camera_calibration writes, for the images that it
/// was recorded with: its region of interest and binning are applied. `is_rectified`: for images
/// without distortion. Empty if the camera is not calibrated (its matrix is 0). Throws Error (kind
/// input) if it is cut off or the list of coefficients is too long.
std::string read_camera_info(const Channel& channel, Bytes message, bool is_rectified,
                             const std::string& thing);

}  // namespace loopbit::recordings
