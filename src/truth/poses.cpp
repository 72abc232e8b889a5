// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/poses.hpp"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/trajectory.hpp"

#include "camera_poses.hpp"
#include "truth_rows.hpp"

namespace loopbit {
namespace {

[[noreturn]] void throw_no_pose_in_time(const RowsByTime& poses, const FrameTimes& times_s) {
  const auto first = std::ranges::find_if(times_s, [](const auto& t) { return t.has_value(); });
  throw Error(ErrorKind::input,
              fmt::format("The poses begin at {:.6f} s and end at {:.6f} s, but no frame is within "
                          "{} s of one (the first frame's time is {:.6f} s): give the trajectory "
                          "of this sequence, with times by the same clock.",
                          poses.first_s(), poses.last_s(), RowsByTime::kMaxDelay_s, **first));
}

std::vector<std::optional<CameraPose>> poses_by_time(const std::vector<CameraPose>& poses,
                                                     const FrameTimes& times_s) {
  std::vector<double> pose_times_s;
  pose_times_s.reserve(poses.size());
  for (const CameraPose& pose : poses) pose_times_s.push_back(pose.timestamp_s.value());
  const RowsByTime rows(pose_times_s);
  std::vector<std::optional<CameraPose>> found(times_s.size());
  bool any = false;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const auto row = times_s[i] ? rows.nearest(*times_s[i]) : std::nullopt;
    if (!row) continue;
    found[i] = poses[*row];
    any = true;
  }
  if (!any) throw_no_pose_in_time(rows, times_s);
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
  const Trajectory read = read_trajectory(path);
  std::vector<CameraPose> poses;
  poses.reserve(read.T_world_camera.size());
  for (const cv::Matx44d& at : read.T_world_camera) {
    CameraPose pose{{}, {at(0, 3), at(1, 3), at(2, 3)}, {at(0, 2), at(1, 2), at(2, 2)}};
    if (!read.times_s.empty()) pose.timestamp_s = read.times_s[poses.size()];
    poses.push_back(pose);
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
