// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "loopbit/camera.hpp"

namespace loopbit {

/// The cameras in a calibration file, in the order of the file. It may be
/// - a `sensor.yaml` of EuRoC or a `camchain.yaml` of Kalibr (lens radtan, equidistant or none);
/// - a `camera_info` of ROS 1 or 2, in YAML (plumb_bob, rational_polynomial or equidistant);
/// - what OpenCV's FileStorage writes as YAML (camera_matrix, distortion_coefficients, and
///   fisheye_model where it is a fisheye);
/// - a `calib.txt` of KITTI odometry (P0 to P3, rectified; the first camera is the body);
/// - a text file with a 3 x 3 camera matrix alone.
/// Throws Error (kind input) if it is none of them, a number is missing or not finite, or the lens
/// has another model.
std::vector<CameraModel> read_cameras(const std::string& path);

/// The camera of a `camera_info` in YAML, such as recorded_camera_info() gives. Throws Error as
/// read_cameras(); `name` is that of its file or topic.
CameraModel parse_camera_info(const std::string& yaml, const std::string& name);

/// The camera number `index` of the file, from 0. Throws Error (kind input) if there are fewer.
CameraModel read_camera(const std::string& path, int index = 0);

/// The calibration file that belongs to the images of `input`, by the layout of a data set: KITTI
/// odometry (`calib.txt` beside `image_0`) or EuRoC (`sensor.yaml` beside the `data` of `cam0`), or
/// a `camera.yaml` in the folder; `input` may also be the `image_1` or `cam1/data` of one camera.
/// Empty if there is none.
struct FoundCamera {
  std::string path;
  int index = 0;

  bool operator==(const FoundCamera&) const = default;
};
std::optional<FoundCamera> find_camera(const std::string& input);

/// `camera` in the words of a `camera_info`, which read_cameras() reads back. Throws nothing.
std::string to_camera_info(const CameraModel& camera);

}  // namespace loopbit
