// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/trajectory.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/text_rows.hpp"

#include "truth_rows.hpp"

namespace loopbit {
namespace {

using truth::kCovarianceColumns;
using truth::kEurocColumns;
using truth::kKittiColumns;
using truth::kTumColumns;

/// Files are rounded; what is further than this from a rotation is something else.
constexpr double kMaxRotationError = 0.01;

using Numbers = std::array<double, kCovarianceColumns>;

bool parse_numbers(const std::vector<std::string_view>& cells, Numbers& numbers) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto number = parse_number<double>(cells[i]);
    if (!number) return false;
    numbers[i] = *number;
  }
  return true;
}

struct PoseRow {
  std::optional<double> time_s;
  cv::Matx44d T_world_camera;
  std::optional<cv::Matx66d> covariance = std::nullopt;
};

/// From the axes of the camera.
cv::Matx44d transform(const cv::Vec3d& right, const cv::Vec3d& down, const cv::Vec3d& ahead,
                      const cv::Vec3d& position_m) {
  return {right[0], down[0], ahead[0], position_m[0], right[1], down[1], ahead[1], position_m[1],
          right[2], down[2], ahead[2], position_m[2], 0,        0,       0,        1};
}

std::optional<PoseRow> kitti_row(const Numbers& n) {
  const cv::Vec3d right(n[0], n[4], n[8]);
  const cv::Vec3d down(n[1], n[5], n[9]);
  const cv::Vec3d ahead(n[2], n[6], n[10]);
  const bool is_rotation = cv::norm(right.cross(down) - ahead) <= kMaxRotationError &&
                           cv::norm(down.cross(ahead) - right) <= kMaxRotationError &&
                           std::abs(cv::norm(ahead) - 1.0) <= kMaxRotationError;
  if (!is_rotation) return std::nullopt;
  const cv::Vec3d exact_ahead = cv::normalize(ahead);
  const cv::Vec3d exact_right = cv::normalize(down.cross(exact_ahead));
  const cv::Vec3d exact_down = exact_ahead.cross(exact_right);
  return PoseRow{{}, transform(exact_right, exact_down, exact_ahead, {n[3], n[7], n[11]})};
}

std::optional<PoseRow> timed_row(double time_s, const cv::Vec3d& position_m, cv::Vec4d q) {
  const double length = cv::norm(q);
  if (!(std::abs(length - 1.0) <= kMaxRotationError)) return std::nullopt;
  q /= length;
  const auto [x, y, z, w] = std::array{q[0], q[1], q[2], q[3]};
  const cv::Vec3d right(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y));
  const cv::Vec3d down(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x));
  const cv::Vec3d ahead(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y));
  return PoseRow{time_s, transform(right, down, ahead, position_m)};
}

std::optional<PoseRow> tum_row(const Numbers& n) {
  return timed_row(n[0], {n[1], n[2], n[3]}, {n[4], n[5], n[6], n[7]});
}

/// Of the body, whose z axis is that of cam0 to 2 degrees.
std::optional<PoseRow> euroc_row(const Numbers& n) {
  constexpr double kNanosecondsPerSecond = 1e9;
  return timed_row(n[0] / kNanosecondsPerSecond, {n[1], n[2], n[3]}, {n[5], n[6], n[7], n[4]});
}

std::optional<PoseRow> covariance_row(const Numbers& n) {
  auto row = tum_row(n);
  if (!row) return std::nullopt;
  cv::Matx66d covariance;
  std::size_t next = kTumColumns;
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) covariance(i, j) = covariance(j, i) = n[next++];
  }
  row->covariance = covariance;
  return row;
}

std::optional<PoseRow> parse_row(const std::vector<std::string_view>& cells) {
  Numbers numbers{};
  if (cells.size() > numbers.size() || !parse_numbers(cells, numbers)) return std::nullopt;
  switch (cells.size()) {
    case kTumColumns:
      return tum_row(numbers);
    case kKittiColumns:
      return kitti_row(numbers);
    case kEurocColumns:
      return euroc_row(numbers);
    case kCovarianceColumns:
      return covariance_row(numbers);
    default:
      return std::nullopt;
  }
}

const char* expected_row(std::size_t columns) {
  switch (columns) {
    case kTumColumns:
      return "a TUM pose: time, position and unit quaternion x y z w";
    case kEurocColumns:
      return "a EuRoC state: time in ns, position, unit quaternion w x y z, and 9 numbers more";
    case kCovarianceColumns:
      return "a TUM pose (time, position and unit quaternion x y z w) and the upper triangle of a "
             "covariance, 21 numbers";
    default:
      return "a KITTI pose (12 numbers: 3 x 4, of a rotation and a position), a TUM pose (8 "
             "numbers), one with its covariance (29) or a EuRoC state (17)";
  }
}

}  // namespace

Trajectory read_trajectory(const std::string& path) {
  Trajectory trajectory;
  std::vector<std::string_view> cells;
  std::size_t columns = 0;
  const std::vector<TextRow> rows = read_rows(path);
  for (const TextRow& row : rows) {
    split_cells(row.text, cells);
    if (&row == rows.data() && are_names(cells)) continue;
    if (columns == 0) columns = cells.size();
    const auto pose = cells.size() == columns ? parse_row(cells) : std::nullopt;
    if (!pose) throw_bad_row(path, row, expected_row(columns));
    trajectory.T_world_camera.push_back(pose->T_world_camera);
    if (pose->time_s) trajectory.times_s.push_back(*pose->time_s);
    if (pose->covariance) trajectory.covariances.push_back(*pose->covariance);
  }
  if (trajectory.T_world_camera.empty()) {
    throw Error(ErrorKind::input, fmt::format("'{}' has no pose: give it one row a pose.", path));
  }
  return trajectory;
}

RowsByTime::RowsByTime(const std::vector<double>& times_s) {
  assert(!times_s.empty());
  rows_.reserve(times_s.size());
  for (std::size_t i = 0; i < times_s.size(); ++i) rows_.emplace_back(times_s[i], i);
  std::ranges::sort(rows_);
}

std::optional<std::size_t> RowsByTime::nearest(double time_s) const {
  const auto time_of = [](const auto& row) { return row.first; };
  auto found = std::ranges::lower_bound(rows_, time_s, {}, time_of);
  if (found != rows_.begin()) {
    const auto before = std::ranges::lower_bound(rows_, (found - 1)->first, {}, time_of);
    const bool is_nearer = found == rows_.end() || time_s - before->first <= found->first - time_s;
    if (is_nearer) found = before;
  }
  if (!(std::abs(found->first - time_s) <= kMaxDelay_s)) return std::nullopt;
  return found->second;
}

}  // namespace loopbit
