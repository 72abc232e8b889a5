// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

constexpr int kMaxNewtonSteps = 30;
constexpr double kNewtonPrecision = 1e-10;

/// A point of the plane z = 1 after the distortion, with its Jacobian.
struct Distorted {
  cv::Vec2d at;
  cv::Matx22d jacobian;
};

/// OpenCV, "Camera Calibration and 3D Reconstruction", section "Detailed Description".
Distorted distort_radial_tangential(const std::array<double, CameraModel::kMaxDistortion>& d,
                                    const cv::Vec2d& point) {
  const auto [k1, k2, p1, p2, k3, k4, k5, k6] = d;
  const double x = point[0];
  const double y = point[1];
  const double r2 = x * x + y * y;
  const double above = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6));
  const double scale = above / below;
  const double above_slope = k1 + r2 * (2 * k2 + r2 * 3 * k3);
  const double below_slope = k4 + r2 * (2 * k5 + r2 * 3 * k6);
  const double slope = 2 * (above_slope - scale * below_slope) / below;  // of scale, by r2 / 2
  const double mixed = x * y * slope + 2 * p1 * x + 2 * p2 * y;
  return {{x * scale + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
           y * scale + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y},
          {scale + x * x * slope + 2 * p1 * y + 6 * p2 * x, mixed, mixed,
           scale + y * y * slope + 6 * p1 * y + 2 * p2 * x}};
}

/// A lens does not turn inside out: where its Jacobian does, the model has left its range.
bool turns_back(const cv::Matx22d& jacobian) {
  return !(cv::determinant(jacobian) > 0 && jacobian(0, 0) > 0);
}

struct BentAngle {
  double angle = 0;  ///< behind the lens
  double slope = 0;  ///< by the angle before it
};

BentAngle bend(const CameraModel& camera, double angle) {
  const auto& k = camera.distortion;
  const double a2 = angle * angle;
  return {angle * (1 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3])))),
          1 + a2 * (3 * k[0] + a2 * (5 * k[1] + a2 * (7 * k[2] + a2 * 9 * k[3])))};
}

cv::Matx22d focal_matrix(const CameraModel& camera) { return {camera.fx, 0, 0, camera.fy}; }

cv::Vec2d pixel_at(const CameraModel& camera, const cv::Vec2d& point) {
  return {camera.fx * point[0] + camera.cx, camera.fy * point[1] + camera.cy};
}

std::optional<cv::Vec2d> project_planar(const CameraModel& camera, const cv::Vec3d& point,
                                        cv::Matx23d* jacobian) {
  if (!(point[2] > 0)) return std::nullopt;
  const double x = point[0] / point[2];
  const double y = point[1] / point[2];
  Distorted distorted{{x, y}, cv::Matx22d::eye()};
  if (camera.lens == Lens::radial_tangential) {
    distorted = distort_radial_tangential(camera.distortion, {x, y});
    if (turns_back(distorted.jacobian)) return std::nullopt;
  }
  if (jacobian != nullptr) {
    const double inverse = 1 / point[2];
    const cv::Matx23d of_plane(inverse, 0, -x * inverse, 0, inverse, -y * inverse);
    *jacobian = focal_matrix(camera) * distorted.jacobian * of_plane;
  }
  return pixel_at(camera, distorted.at);
}

std::optional<cv::Vec2d> project_equidistant(const CameraModel& camera, const cv::Vec3d& point,
                                             cv::Matx23d* jacobian) {
  const double side = std::hypot(point[0], point[1]);
  const double length_sq = point.dot(point);
  if (!(length_sq > 0)) return std::nullopt;
  const double angle = std::atan2(side, point[2]);
  const BentAngle bent = bend(camera, angle);
  if (!(bent.slope > 0)) return std::nullopt;
  constexpr double kOnAxis = 1e-9;
  const bool is_on_axis = side < kOnAxis * std::abs(point[2]);
  if (is_on_axis && point[2] < 0) return std::nullopt;
  // Towards the axis, angle / side is 1 / z.
  const double stretch = is_on_axis ? 1 / point[2] : bent.angle / side;
  if (jacobian != nullptr) {
    const double ux = is_on_axis ? 1 : point[0] / side;
    const double uy = is_on_axis ? 0 : point[1] / side;
    const double outward = bent.slope * point[2] / length_sq;  // d bent / d side
    const double forward = -bent.slope * side / length_sq;     // d bent / d z
    const cv::Matx23d bent_by_point(
        ux * ux * outward + uy * uy * stretch, ux * uy * (outward - stretch), ux * forward,
        ux * uy * (outward - stretch), uy * uy * outward + ux * ux * stretch, uy * forward);
    *jacobian = focal_matrix(camera) * bent_by_point;
  }
  return pixel_at(camera, {point[0] * stretch, point[1] * stretch});
}

std::optional<cv::Vec3d> unproject_planar(const CameraModel& camera, const cv::Vec2d& bent) {
  cv::Vec2d at = bent;
  if (camera.lens == Lens::radial_tangential) {
    bool is_found = false;
    for (int step = 0; step < kMaxNewtonSteps && !is_found; ++step) {
      const Distorted distorted = distort_radial_tangential(camera.distortion, at);
      if (turns_back(distorted.jacobian)) return std::nullopt;
      const cv::Vec2d error = bent - distorted.at;
      at += distorted.jacobian.inv() * error;
      is_found = cv::norm(error) < kNewtonPrecision;
    }
    if (!is_found) return std::nullopt;
  }
  return cv::normalize(cv::Vec3d(at[0], at[1], 1));
}

std::optional<cv::Vec3d> unproject_equidistant(const CameraModel& camera, const cv::Vec2d& bent) {
  const double wanted = cv::norm(bent);
  if (wanted < kNewtonPrecision) return cv::Vec3d(0, 0, 1);
  double angle = std::min(wanted, std::numbers::pi / 2);
  for (int step = 0; step < kMaxNewtonSteps; ++step) {
    const BentAngle at = bend(camera, angle);
    if (!(at.slope > 0)) return std::nullopt;
    const double error = wanted - at.angle;
    angle += error / at.slope;
    if (!(angle >= 0 && angle <= std::numbers::pi)) return std::nullopt;
    if (std::abs(error) < kNewtonPrecision) {
      const double sine = std::sin(angle) / wanted;
      return cv::Vec3d(bent[0] * sine, bent[1] * sine, std::cos(angle));
    }
  }
  return std::nullopt;
}

}  // namespace

std::string_view to_string(Lens lens) {
  switch (lens) {
    case Lens::pinhole:
      return "pinhole";
    case Lens::radial_tangential:
      return "radial_tangential";
    case Lens::equidistant:
      return "equidistant";
  }
  return "";
}

void validate(const CameraModel& camera, const std::string& name) {
  const auto fail = [&](const std::string& fault) {
    throw Error(ErrorKind::input, fmt::format("{}: {}; calibrate the camera again, or correct the "
                                              "file.",
                                              name, fault));
  };
  for (const double number : {camera.fx, camera.fy, camera.cx, camera.cy}) {
    if (!std::isfinite(number)) fail(fmt::format("the intrinsics contain {}", number));
  }
  for (const double number : camera.distortion) {
    if (!std::isfinite(number)) fail(fmt::format("the distortion contains {}", number));
  }
  if (!(camera.fx > 0 && camera.fy > 0)) {
    fail(fmt::format("the focal lengths are {} and {} px, but must be positive", camera.fx,
                     camera.fy));
  }
  const cv::Size size = camera.size_px;
  if (size.width < 0 || size.height < 0) {
    fail(fmt::format("the image size is {} x {}", size.width, size.height));
  }
  const bool is_inside =
      camera.cx >= 0 && camera.cy >= 0 && camera.cx <= size.width && camera.cy <= size.height;
  if (!size.empty() && !is_inside) {
    fail(fmt::format("the principal point ({}, {}) is outside the image of {} x {} px", camera.cx,
                     camera.cy, size.width, size.height));
  }
}

void check_size(const CameraModel& camera, const std::string& name, cv::Size size_px) {
  if (camera.size_px == size_px) return;
  if (!camera.size_px.empty()) {
    throw Error(ErrorKind::input,
                fmt::format("{} is for images of {} x {} px, but an image has {} x {}; give the "
                            "calibration of these images.",
                            name, camera.size_px.width, camera.size_px.height, size_px.width,
                            size_px.height));
  }
  if (camera.cx < size_px.width && camera.cy < size_px.height) return;
  throw Error(ErrorKind::input,
              fmt::format("{} has its principal point at ({}, {}), outside an image of {} x {} px; "
                          "give the calibration of these images.",
                          name, camera.cx, camera.cy, size_px.width, size_px.height));
}

CameraModel resized(const CameraModel& camera, cv::Size size_px) {
  if (camera.size_px.empty() || camera.size_px == size_px) return camera;
  const double x_scale = static_cast<double>(size_px.width) / camera.size_px.width;
  const double y_scale = static_cast<double>(size_px.height) / camera.size_px.height;
  CameraModel result = camera;
  result.size_px = size_px;
  result.fx *= x_scale;
  result.fy *= y_scale;
  result.cx = (camera.cx + 0.5) * x_scale - 0.5;
  result.cy = (camera.cy + 0.5) * y_scale - 0.5;
  return result;
}

std::optional<cv::Vec2d> project(const CameraModel& camera, const cv::Vec3d& point,
                                 cv::Matx23d* jacobian) {
  return camera.lens == Lens::equidistant ? project_equidistant(camera, point, jacobian)
                                          : project_planar(camera, point, jacobian);
}

std::optional<cv::Vec3d> unproject(const CameraModel& camera, const cv::Vec2d& pixel_px,
                                   cv::Matx32d* jacobian) {
  const cv::Vec2d bent((pixel_px[0] - camera.cx) / camera.fx,
                       (pixel_px[1] - camera.cy) / camera.fy);
  auto direction = camera.lens == Lens::equidistant ? unproject_equidistant(camera, bent)
                                                    : unproject_planar(camera, bent);
  if (!direction || jacobian == nullptr) return direction;
  // Its inverse on the plane of directions that keep the unit length.
  cv::Matx23d forward;
  if (!project(camera, *direction, &forward)) return std::nullopt;
  const cv::Vec3d& b = *direction;
  const cv::Matx33d whole(forward(0, 0), forward(0, 1), forward(0, 2), forward(1, 0), forward(1, 1),
                          forward(1, 2), b[0], b[1], b[2]);
  *jacobian = whole.inv().get_minor<3, 2>(0, 0);
  return direction;
}

}  // namespace loopbit
