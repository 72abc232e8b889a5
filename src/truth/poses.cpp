// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/poses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/text_rows.hpp"

#include "camera_poses.hpp"
#include "truth_rows.hpp"

namespace loopbit {
namespace {

using truth::kEurocColumns;
using truth::kKittiColumns;
using truth::kTumColumns;

/// Files are rounded; what is further than this from a rotation is something else.
constexpr double kMaxRotationError = 0.01;

using Numbers = std::array<double, kEurocColumns>;

bool parse_numbers(const std::vector<std::string_view>& cells, Numbers& numbers) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto number = parse_number<double>(cells[i]);
    if (!number) return false;
    numbers[i] = *number;
  }
  return true;
}

std::optional<CameraPose> kitti_pose(const Numbers& n) {
  const cv::Vec3d right(n[0], n[4], n[8]);
  const cv::Vec3d down(n[1], n[5], n[9]);
  const cv::Vec3d ahead(n[2], n[6], n[10]);
  const bool is_rotation = cv::norm(right.cross(down) - ahead) <= kMaxRotationError &&
                           cv::norm(down.cross(ahead) - right) <= kMaxRotationError &&
                           std::abs(cv::norm(ahead) - 1.0) <= kMaxRotationError;
  if (!is_rotation) return std::nullopt;
  return CameraPose{{}, {n[3], n[7], n[11]}, cv::normalize(ahead)};
}

std::optional<CameraPose> timed_pose(double time_s, const cv::Vec3d& position_m, cv::Vec4d q) {
  const double length = cv::norm(q);
  if (!(std::abs(length - 1.0) <= kMaxRotationError)) return std::nullopt;
  q /= length;
  const auto [x, y, z, w] = std::array{q[0], q[1], q[2], q[3]};
  const cv::Vec3d ahead(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y));
  return CameraPose{time_s, position_m, cv::normalize(ahead)};
}

std::optional<CameraPose> tum_pose(const Numbers& n) {
  return timed_pose(n[0], {n[1], n[2], n[3]}, {n[4], n[5], n[6], n[7]});
}

/// Of the body, whose z axis is that of cam0 to 2 degrees.
std::optional<CameraPose> euroc_pose(const Numbers& n) {
  constexpr double kNanosecondsPerSecond = 1e9;
  return timed_pose(n[0] / kNanosecondsPerSecond, {n[1], n[2], n[3]}, {n[5], n[6], n[7], n[4]});
}

std::optional<CameraPose> parse_pose(const std::vector<std::string_view>& cells) {
  Numbers numbers{};
  if (cells.size() > numbers.size() || !parse_numbers(cells, numbers)) return std::nullopt;
  switch (cells.size()) {
    case kTumColumns:
      return tum_pose(numbers);
    case kKittiColumns:
      return kitti_pose(numbers);
    case kEurocColumns:
      return euroc_pose(numbers);
    default:
      return std::nullopt;
  }
}

const char* expected_pose(std::size_t columns) {
  switch (columns) {
    case kTumColumns:
      return "a TUM pose: time, position and unit quaternion x y z w";
    case kEurocColumns:
      return "a EuRoC state: time in ns, position, unit quaternion w x y z, and 9 numbers more";
    default:
      return "a KITTI pose (12 numbers: 3 x 4, of a rotation and a position), a TUM pose (8 "
             "numbers) or a EuRoC state (17)";
  }
}

struct TimedPose {
  double time_s;
  const CameraPose* pose;
};

/// The pose nearest to `time_s`, the earlier of two; `poses` are by time.
const TimedPose& nearest(const std::vector<TimedPose>& poses, double time_s) {
  const auto after = std::ranges::lower_bound(poses, time_s, {}, &TimedPose::time_s);
  if (after == poses.begin()) return poses.front();
  // The first of equal times.
  const auto before = std::ranges::lower_bound(poses, (after - 1)->time_s, {}, &TimedPose::time_s);
  if (after == poses.end()) return *before;
  return time_s - before->time_s <= after->time_s - time_s ? *before : *after;
}

[[noreturn]] void throw_no_pose_in_time(const std::vector<TimedPose>& poses,
                                        const FrameTimes& times_s) {
  const auto first = std::ranges::find_if(times_s, [](const auto& t) { return t.has_value(); });
  throw Error(ErrorKind::input,
              fmt::format("The poses begin at {:.6f} s and end at {:.6f} s, but no frame is within "
                          "{} s of one (the first frame's time is {:.6f} s): give the trajectory "
                          "of this sequence, with times by the same clock.",
                          poses.front().time_s, poses.back().time_s, kMaxPoseDelay_s, **first));
}

std::vector<std::optional<CameraPose>> poses_by_time(const std::vector<CameraPose>& poses,
                                                     const FrameTimes& times_s) {
  std::vector<TimedPose> sorted;
  sorted.reserve(poses.size());
  for (const CameraPose& pose : poses) sorted.push_back({pose.timestamp_s.value(), &pose});
  std::ranges::stable_sort(sorted, {}, &TimedPose::time_s);
  std::vector<std::optional<CameraPose>> found(times_s.size());
  bool any = false;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    if (!times_s[i]) continue;
    const TimedPose& near = nearest(sorted, *times_s[i]);
    if (std::abs(near.time_s - *times_s[i]) > kMaxPoseDelay_s) continue;
    found[i] = *near.pose;
    any = true;
  }
  if (!any) throw_no_pose_in_time(sorted, times_s);
  return found;
}

bool have_times(const std::vector<CameraPose>& poses) {
  return poses.front().timestamp_s.has_value();
}

/// See read_positions().
Positions positions_by_row(const std::string& path, const std::vector<CameraPose>& poses,
                           const FramesRead& frames) {
  check_every(frames.every);
  if (have_times(poses)) truth::check_pose_each(path, poses.size(), frames);
  truth::check_rows(path, poses.size(), "poses", frames);
  const auto step = static_cast<std::size_t>(frames.every);
  const std::size_t count = frames.times_s.size();
  Positions positions_m;
  positions_m.reserve(count);
  for (std::size_t k = 0; k < count; ++k) positions_m.emplace_back(poses[k * step].position_m);
  return positions_m;
}

}  // namespace

std::vector<CameraPose> read_poses(const std::string& path) {
  std::vector<CameraPose> poses;
  std::vector<std::string_view> cells;
  std::size_t columns = 0;
  for (const auto& row : read_rows(path)) {
    split_cells(row.text, cells);
    if (columns == 0) columns = cells.size();
    const auto pose = cells.size() == columns ? parse_pose(cells) : std::nullopt;
    if (!pose) throw_bad_row(path, row, expected_pose(columns));
    poses.push_back(*pose);
  }
  if (poses.empty()) {
    throw Error(ErrorKind::input, fmt::format("'{}' has no pose: give it one row a pose.", path));
  }
  return poses;
}

std::vector<std::optional<CameraPose>> poses_of_frames(const std::vector<CameraPose>& poses,
                                                       const FrameTimes& times_s) {
  const auto has_time = [](const auto& time) { return time.has_value(); };
  const bool poses_timed =
      !poses.empty() && std::ranges::all_of(poses, has_time, &CameraPose::timestamp_s);
  if (poses_timed && std::ranges::any_of(times_s, has_time)) return poses_by_time(poses, times_s);
  if (poses.size() == times_s.size()) return {poses.begin(), poses.end()};
  throw Error(ErrorKind::input,
              fmt::format("There are {} poses but {} frames, and {} have no times to tell which "
                          "belong together: give one pose a frame, or times for both.",
                          poses.size(), times_s.size(), poses_timed ? "the frames" : "the poses"));
}

Positions read_positions(const std::string& path, FramesRead frames) {
  const std::vector<CameraPose> poses = read_poses(path);
  const bool is_known = !frames.times_s.empty();
  frames.all = false;  // of a run that ended early, too
  if (!have_times(poses) || (is_known && !truth::has_times(frames))) {
    if (!is_known) frames = {.times_s = FrameTimes(poses.size())};
    return positions_by_row(path, poses, frames);
  }
  Positions positions_m;
  if (!is_known) return positions_m;
  positions_m.reserve(frames.times_s.size());
  const auto of_frames =
      truth::made_of_file(path, [&] { return poses_of_frames(poses, frames.times_s); });
  for (const auto& pose : of_frames) {
    positions_m.push_back(pose ? std::optional(pose->position_m) : std::nullopt);
  }
  return positions_m;
}

void check_poses(const std::string& path, const FramesRead& frames) {
  const std::vector<CameraPose> poses = read_poses(path);
  if (!frames.times_s.empty() && !have_times(poses)) (void)positions_by_row(path, poses, frames);
}

}  // namespace loopbit
