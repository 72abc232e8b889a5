// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Messages: https://docs.ros2.org/latest/api/nav_msgs, geometry_msgs, tf2_msgs and sensor_msgs.
#include "motion_message.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <opencv2/core/quaternion.hpp>

#include "loopbit/error.hpp"

#include "field_reader.hpp"

namespace loopbit::recordings {
namespace {

enum class Kind : std::uint8_t { none, odometry, pose, transform, transforms };

Kind kind_of(const Channel& channel) {
  if (channel.encoding == Encoding::other) return Kind::none;
  std::string type = channel.type;
  if (const auto infix = type.find("/msg/"); infix != std::string::npos) type.erase(infix, 4);
  constexpr std::array<std::pair<std::string_view, Kind>, 6> kKinds = {{
      {"nav_msgs/Odometry", Kind::odometry},
      {"geometry_msgs/PoseStamped", Kind::pose},
      {"geometry_msgs/PoseWithCovarianceStamped", Kind::pose},
      {"geometry_msgs/TransformStamped", Kind::transform},
      {"tf2_msgs/TFMessage", Kind::transforms},
      {"tf/tfMessage", Kind::transforms},
  }};
  const auto* const known =
      std::ranges::find(kKinds, type, [](const auto& kind) { return kind.first; });
  return known == kKinds.end() ? Kind::none : known->second;
}

/// A position, or a translation, and a quaternion x y z w.
cv::Matx44d read_pose(FieldReader& fields, const std::string& thing) {
  std::array<double, 7> numbers{};
  for (double& number : numbers) number = fields.real();
  fields.check_whole(thing);
  const auto& [x, y, z, qx, qy, qz, qw] = numbers;
  const double length = std::sqrt(qx * qx + qy * qy + qz * qz + qw * qw);
  constexpr double kMaxRounding = 0.01;
  const bool is_finite =
      std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
  if (!is_finite || std::abs(length - 1) > kMaxRounding) {
    throw Error(ErrorKind::input,
                fmt::format("{} has the pose {}, where a finite position and a unit quaternion are "
                            "needed: leave it out.",
                            thing, fmt::join(numbers, " ")));
  }
  cv::Matx44d transform = cv::Quatd(qw, qx, qy, qz).normalize().toRotMat4x4();
  transform(0, 3) = x;
  transform(1, 3) = y;
  transform(2, 3) = z;
  return transform;
}

TimedTransform read_transform(FieldReader& fields, bool has_child, const std::string& thing) {
  const Header header = fields.header();
  TimedTransform read{.time_s = header.stamp.in_seconds(),
                      .parent = without_slash(header.frame_id),
                      .child = {},
                      .T_parent_child = {}};
  if (has_child) read.child = without_slash(fields.text());
  read.T_parent_child = read_pose(fields, thing);
  return read;
}

/// The intrinsics of a message.
struct Intrinsics {
  double width_px = 0;
  double height_px = 0;
  std::string distortion_model;
  std::vector<double> distortion;
  double fx = 0;
  double fy = 0;
  double cx = 0;
  double cy = 0;
};

/// Reads up to the projection matrix.
Intrinsics read_intrinsics(FieldReader& fields, bool is_rectified, const std::string& thing) {
  constexpr std::uint32_t kMostCoefficients = 32;
  Intrinsics camera;
  camera.height_px = fields.number();
  camera.width_px = fields.number();
  camera.distortion_model = fields.text();
  const std::uint32_t count = fields.number();
  if (count > kMostCoefficients) {
    throw Error(ErrorKind::input, fmt::format("{} has {} distortion coefficients, where at most {} "
                                              "are known: calibrate the camera again.",
                                              thing, count, kMostCoefficients));
  }
  for (std::uint32_t i = 0; i < count; ++i) camera.distortion.push_back(fields.real());
  std::array<double, 9> k{};
  for (double& number : k) number = fields.real();
  for (std::size_t i = 0; i < k.size(); ++i) fields.real();  // the rotation that rectifies
  std::array<double, 12> p{};
  for (double& number : p) number = fields.real();
  camera.fx = is_rectified ? p[0] : k[0];
  camera.fy = is_rectified ? p[5] : k[4];
  camera.cx = is_rectified ? p[2] : k[2];
  camera.cy = is_rectified ? p[6] : k[5];
  if (is_rectified) camera.distortion.clear();
  return camera;
}

/// Reads binning and region of interest, and applies them. The centres of pixels are whole numbers.
void crop(FieldReader& fields, Intrinsics& camera) {
  const double bin_x = std::max(fields.number(), 1U);
  const double bin_y = std::max(fields.number(), 1U);
  const double left = fields.number();
  const double top = fields.number();
  const double height = fields.number();
  const double width = fields.number();
  if (width > 0 && height > 0) {
    camera.width_px = width;
    camera.height_px = height;
    camera.cx -= left;
    camera.cy -= top;
  }
  camera.width_px = std::floor(camera.width_px / bin_x);
  camera.height_px = std::floor(camera.height_px / bin_y);
  camera.fx /= bin_x;
  camera.fy /= bin_y;
  camera.cx = (camera.cx + 0.5) / bin_x - 0.5;
  camera.cy = (camera.cy + 0.5) / bin_y - 0.5;
}

}  // namespace

std::string without_slash(std::string frame) {
  if (frame.starts_with('/')) frame.erase(0, 1);
  return frame;
}

bool is_motion(const Channel& channel) { return kind_of(channel) != Kind::none; }

std::vector<TimedTransform> read_transforms(const Channel& channel, Bytes message,
                                            const std::string& thing) {
  FieldReader fields(channel, message, thing);
  const Kind kind = kind_of(channel);
  std::vector<TimedTransform> transforms;
  const std::uint32_t count = kind == Kind::transforms ? fields.number() : 1;
  for (std::uint32_t i = 0; i < count; ++i) {
    transforms.push_back(read_transform(fields, kind != Kind::pose, thing));
  }
  fields.check_whole(thing);
  return transforms;
}

bool is_camera_info(const Channel& channel) {
  const bool is_type =
      channel.type == "sensor_msgs/msg/CameraInfo" || channel.type == "sensor_msgs/CameraInfo";
  return is_type && channel.encoding != Encoding::other;
}

std::string read_camera_info(const Channel& channel, Bytes message, bool is_rectified,
                             const std::string& thing) {
  FieldReader fields(channel, message, thing);
  fields.header();
  Intrinsics camera = read_intrinsics(fields, is_rectified, thing);
  crop(fields, camera);
  fields.check_whole(thing);
  if (camera.fx == 0) return {};
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
      "  data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]\n"
      "distortion_model: \"{}\"\ndistortion_coefficients:\n  rows: 1\n  cols: {}\n  data: [{}]\n",
      camera.width_px, camera.height_px, camera.fx, camera.cx, camera.fy, camera.cy,
      camera.distortion_model, camera.distortion.size(), fmt::join(camera.distortion, ", "));
}

}  // namespace loopbit::recordings
