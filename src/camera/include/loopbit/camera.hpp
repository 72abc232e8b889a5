// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include <opencv2/core.hpp>

namespace loopbit {

/// How a lens bends rays.
enum class Lens {
  pinhole,            ///< not at all
  radial_tangential,  ///< OpenCV's plumb_bob and rational model (Brown-Conrady)
  equidistant,        ///< fisheye (Kannala and Brandt 2006; OpenCV's fisheye module)
};

/// "pinhole", "radial_tangential" or "equidistant".
std::string_view to_string(Lens lens);

/// A calibrated camera. Its frame is x right, y down, z forward. Pixel (0, 0) is the centre of the
/// upper left pixel, as in OpenCV, ROS, Kalibr and KITTI.
struct CameraModel {
  static constexpr std::size_t kMaxDistortion = 8;

  Lens lens = Lens::pinhole;
  cv::Size size_px = {};  ///< of the calibrated images; 0 x 0 if the file does not say
  double fx = 0;
  double fy = 0;
  double cx = 0;
  double cy = 0;
  /// radial_tangential: k1 k2 p1 p2 k3 k4 k5 k6, where k4 to k6 divide. equidistant: k1 k2 k3 k4.
  /// The rest is 0.
  std::array<double, kMaxDistortion> distortion{};
  /// From the camera's frame to the body's (an IMU, or the first camera of a stereo rig), if known.
  std::optional<cv::Matx44d> T_body_camera = std::nullopt;

  bool operator==(const CameraModel&) const = default;
};

/// Throws Error (kind input) if a number is not finite, a focal length is not positive, or the
/// principal point is outside the image. `name` begins the sentence.
void validate(const CameraModel& camera, const std::string& name);

/// Throws Error (kind input) if images of `size_px` cannot be from `camera`: the camera has
/// another size, or, without a size, its principal point is outside. `name` is that of the camera.
void check_size(const CameraModel& camera, const std::string& name, cv::Size size_px);

/// The camera of images that were resized to `size_px`. Pixels keep their centres, so the principal
/// point moves by half a pixel, too. Does nothing if the camera has no size.
CameraModel resized(const CameraModel& camera, cv::Size size_px);

/// Where the camera sees `point` (in its frame, any length), in pixels; may be outside the image.
/// None for a point behind a pinhole, at the centre, or so far out that the distortion turns back.
/// `jacobian`: if not null, receives d pixel / d point.
std::optional<cv::Vec2d> project(const CameraModel& camera, const cv::Vec3d& point,
                                 cv::Matx23d* jacobian = nullptr);

/// The direction, of unit length, from which the camera sees `pixel_px`. None if the lens has no
/// ray there. `jacobian`: if not null, receives d direction / d pixel. The distortion is inverted
/// by Newton's method, to 1e-10 of a focal length. Cost: 0.1 to 0.4 microseconds.
std::optional<cv::Vec3d> unproject(const CameraModel& camera, const cv::Vec2d& pixel_px,
                                   cv::Matx32d* jacobian = nullptr);

}  // namespace loopbit
