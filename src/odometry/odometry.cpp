// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/odometry.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/core/hal/hal.hpp>

#include "loopbit/error.hpp"
#include "loopbit/rigid_motion.hpp"

namespace loopbit {
namespace {

constexpr double kRadians = std::numbers::pi / 180;
/// Files are rounded; what is further than this from a rotation is something else.
constexpr double kMaxSkew = 1e-3;

bool is_finite(const double* first, int count) {
  return std::all_of(first, first + count, [](double value) { return std::isfinite(value); });
}

bool is_rigid(const cv::Matx44d& transform) {
  const cv::Matx33d rotation = transform.get_minor<3, 3>(0, 0);
  const double error = cv::norm(rotation * rotation.t() - cv::Matx33d::eye(), cv::NORM_INF);
  const bool has_last_row =
      transform(3, 0) == 0 && transform(3, 1) == 0 && transform(3, 2) == 0 && transform(3, 3) == 1;
  return has_last_row && error <= kMaxSkew && cv::determinant(rotation) > 0;
}

bool is_covariance(const cv::Matx66d& covariance) {
  if (!is_finite(covariance.val, 36)) return false;
  const double size = cv::norm(covariance, cv::NORM_INF);
  if (!(cv::norm(covariance - covariance.t(), cv::NORM_INF) <= 1e-9 * size)) return false;
  cv::Matx66d work = covariance;
  return cv::hal::Cholesky64f(work.val, 6 * sizeof(double), 6, nullptr, 0, 0);
}

}  // namespace

Motion chained(const Motion& first, const Motion& second) {
  const cv::Matx66d adjoint = rigid::adjoint(rigid::inverse(second.T_from_to));
  return {first.T_from_to * second.T_from_to,
          adjoint * first.covariance * adjoint.t() + second.covariance};
}

cv::Matx66d drift_covariance(const cv::Matx44d& T_from_to, const OdometryDrift& drift) {
  constexpr double kLeastPosition_m = 1e-4;
  constexpr double kLeastRotation = 1e-3 * kRadians;
  const double distance_m = cv::norm(rigid::translation(T_from_to));
  const double turned = rigid::angle(T_from_to);
  // Independent steps with this variance add up to the drift over the correlated distance.
  const double variance_m = distance_m * std::max(distance_m, drift.correlated_m);
  const double position_m = drift.position_per_m * drift.position_per_m * variance_m;
  const double per_m = drift.rotation_deg_per_m * kRadians;
  const double rotation = per_m * per_m * variance_m + drift.rotation_per_rad *
                                                           drift.rotation_per_rad * turned *
                                                           std::max(turned, 1.0);
  const double p = position_m + kLeastPosition_m * kLeastPosition_m;
  const double r = rotation + kLeastRotation * kLeastRotation;
  return cv::Matx66d::diag({p, p, p, r, r, r});
}

Motion odometry_step(const cv::Matx44d& before, const OdometryPose& pose,
                     const OdometryDrift& drift) {
  const cv::Matx44d step = rigid::inverse(before) * pose.T_odometry_camera;
  return {step, pose.covariance ? *pose.covariance : drift_covariance(step, drift)};
}

bool is_valid(const OdometryPose& pose) {
  return is_finite(pose.T_odometry_camera.val, 16) && is_rigid(pose.T_odometry_camera) &&
         (!pose.covariance || is_covariance(*pose.covariance));
}

void check_odometry(const OdometryPose& pose, const std::string& name) {
  if (!is_valid({pose.T_odometry_camera})) {
    throw Error(ErrorKind::input,
                fmt::format("{} is not a rigid motion: give a rotation (3 x 3), a finite position "
                            "in metres, and 0 0 0 1 as the last row.",
                            name));
  }
  if (!is_valid(pose)) {
    throw Error(ErrorKind::input,
                fmt::format("{} has a covariance that is not positive definite: "
                            "give a symmetric one of (x, y, z, rx, ry, rz), or none.",
                            name));
  }
}

OdometryTrack::OdometryTrack(const OdometryDrift& drift) : drift_(drift) {
  validate(drift, "odometry");
}

OdometryTrack::Frame OdometryTrack::next(const std::optional<OdometryPose>& pose) const {
  Frame frame = end_;
  if (!pose) return frame;
  check_odometry(*pose, fmt::format("The odometry of frame {}", size_));
  frame.is_known = true;
  frame.pose = pose->T_odometry_camera;
  if (frames_.empty()) return frame;
  const Frame& last = frames_.back();
  const Motion step = odometry_step(last.pose, *pose, drift_);
  const cv::Matx66d adjoint = rigid::adjoint(frame.pose);
  frame.path_m += cv::norm(rigid::translation(step.T_from_to));
  frame.drift = last.drift + adjoint * step.covariance * adjoint.t();
  return frame;
}

void OdometryTrack::add(const std::optional<OdometryPose>& pose) {
  if (pose) {
    const Frame frame = next(pose);
    frames_.resize(static_cast<std::size_t>(size_), end_);
    frames_.push_back(frame);
    end_.path_m = frame.path_m;
  }
  ++size_;
}

void OdometryTrack::reserve_next(bool is_known) {
  const auto needed = static_cast<std::size_t>(size_) + 1;
  if (is_known && frames_.capacity() < needed) frames_.reserve(2 * needed);
}

const OdometryTrack::Frame& OdometryTrack::at(int frame) const {
  if (frame < 0 || frame >= size_) throw std::out_of_range("OdometryTrack");
  const auto index = static_cast<std::size_t>(frame);
  return index < frames_.size() ? frames_[index] : end_;
}

std::optional<Motion> OdometryTrack::between(int from, int to) const {
  auto motion = to_next(from, at(to));
  if (motion && to < from) motion->covariance *= -1;  // of the drift since `to`
  return motion;
}

std::optional<Motion> OdometryTrack::to_next(int from, const Frame& next) const {
  const Frame& a = at(from);
  if (!a.is_known || !next.is_known) return std::nullopt;
  const cv::Matx44d back = rigid::inverse(next.pose);
  const cv::Matx66d adjoint = rigid::adjoint(back);
  return Motion{rigid::inverse(a.pose) * next.pose, adjoint * (next.drift - a.drift) * adjoint.t()};
}

double OdometryTrack::path_m(int frame) const { return at(frame).path_m; }

}  // namespace loopbit
