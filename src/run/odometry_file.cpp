// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "odometry_file.hpp"

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/poses.hpp"
#include "loopbit/rigid_motion.hpp"

namespace loopbit {
namespace {

void check_order(const std::string& path, const std::vector<double>& times_s) {
  for (std::size_t i = 1; i < times_s.size(); ++i) {
    if (times_s[i] >= times_s[i - 1]) continue;
    throw Error(ErrorKind::input,
                fmt::format("'{}' goes back in time at pose {}, from {:.6f} s to {:.6f} s: give "
                            "the odometry in order of time.",
                            path, i + 1, times_s[i - 1], times_s[i]));
  }
}

void check_times(const std::string& path, const RowsByTime& rows, const Frame& first) {
  if (!first.timestamp_s) {
    throw Error(ErrorKind::input,
                fmt::format("'{}' tells the odometry by time, but '{}' has no time: give the times "
                            "of the images, or KITTI poses, one per frame.",
                            path, first.name));
  }
  if (*first.timestamp_s <= rows.last_s() + RowsByTime::kMaxDelay_s) return;
  throw Error(
      ErrorKind::input,
      fmt::format("The odometry of '{}' ends at {:.6f} s, but the frames begin at {:.6f} s: "
                  "give the odometry of this sequence, with times by the same clock.",
                  path, rows.last_s(), *first.timestamp_s));
}

}  // namespace

OdometryFile::OdometryFile(const std::string& path, const FramesRead& frames, const Frame& first)
    : path_(path),
      every_(static_cast<std::size_t>(frames.every)),
      trajectory_(read_trajectory(path)) {
  if (trajectory_.times_s.empty()) {
    FramesRead at_least = frames;
    at_least.all = false;
    check_poses(path, at_least);
    return;
  }
  check_order(path, trajectory_.times_s);
  by_time_.emplace(trajectory_.times_s);
  check_times(path, *by_time_, first);
  // The first is of a motion since nothing.
  for (std::size_t i = 1; i < trajectory_.covariances.size(); ++i) {
    check_odometry({trajectory_.T_world_camera[i], trajectory_.covariances[i]},
                   fmt::format("'{}', pose {}", path, i + 1));
  }
}

/// Of the motion from one row to another, in the frame of the latter.
cv::Matx66d OdometryFile::covariance_between(std::size_t from, std::size_t to) const {
  const auto& poses = trajectory_.T_world_camera;
  const cv::Matx44d back = rigid::inverse(poses[to]);
  cv::Matx66d sum = cv::Matx66d::zeros();
  for (std::size_t row = from + 1; row <= to; ++row) {
    const cv::Matx66d carry = rigid::adjoint(back * poses[row]);
    sum += carry * trajectory_.covariances[row] * carry.t();
  }
  return sum;
}

std::optional<std::size_t> OdometryFile::row_of(const Frame& frame) const {
  if (by_time_) return frame.timestamp_s ? by_time_->nearest(*frame.timestamp_s) : std::nullopt;
  const std::size_t row = frames_ * every_;
  return row < trajectory_.T_world_camera.size() ? std::optional(row) : std::nullopt;
}

std::optional<OdometryPose> OdometryFile::next(const Frame& frame) {
  const auto row = row_of(frame);
  ++frames_;
  if (!row) return std::nullopt;
  OdometryPose pose{trajectory_.T_world_camera[*row]};
  const bool is_later = last_row_ && *last_row_ < *row;
  if (is_later && !trajectory_.covariances.empty()) {
    pose.covariance = covariance_between(*last_row_, *row);
  }
  last_row_ = row;
  return pose;
}

void OdometryFile::check_used() const {
  if (last_row_ || !by_time_ || frames_ == 0) return;
  throw Error(ErrorKind::input,
              fmt::format("'{}' has odometry from {:.6f} s to {:.6f} s, but no frame is within {} "
                          "s of it: give the odometry of this sequence, with times by the same "
                          "clock.",
                          path_, by_time_->first_s(), by_time_->last_s(), RowsByTime::kMaxDelay_s));
}

}  // namespace loopbit
