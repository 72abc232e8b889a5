// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The first byte says what the others are: odometry, a pose, transforms or a camera, of ROS 2 or
// ROS 1.
#include <array>

#include "loopbit/camera_file.hpp"
#include "loopbit/error.hpp"

#include "motion_message.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace recordings = loopbit::recordings;
  constexpr std::array kTypes = {"nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped",
                                 "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/CameraInfo"};
  if (size == 0) return 0;
  const bool is_ros1 = (data[0] & 4U) != 0;
  const recordings::Channel channel{
      .topic = "/topic",
      .type = kTypes.at(data[0] & 3U),
      .encoding = is_ros1 ? recordings::Encoding::ros1 : recordings::Encoding::cdr};
  const recordings::Bytes message{data + 1, size - 1};
  try {
    if (!recordings::is_camera_info(channel)) {
      (void)recordings::read_transforms(channel, message, "A message");
      return 0;
    }
    const bool is_rectified = (data[0] & 8U) != 0;
    const std::string yaml =
        recordings::read_camera_info(channel, message, is_rectified, "A message");
    if (!yaml.empty()) (void)loopbit::parse_camera_info(yaml, "A message");
  } catch (const loopbit::Error&) {  // refused, as it should be
  }
  return 0;
}
