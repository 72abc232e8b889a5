// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/ground_truth.hpp"
#include "loopbit/options.hpp"

namespace loopbit {

/// Position and viewing direction of a camera in the world frame.
struct CameraPose {
  std::optional<double> timestamp_s;  ///< if the file has times
  cv::Vec3d position_m;
  cv::Vec3d ahead;  ///< the viewing direction (the camera's z axis), unit length
};

/// Reads poses, one per row: KITTI poses (12 numbers: camera to world, 3 x 4), a TUM trajectory (8
/// numbers: time, position, quaternion x y z w) or EuRoC states (17: time in ns, position,
/// quaternion w x y z, 9 that are not read; of the body, not of the camera). All rows have one
/// kind. Numbers are separated by spaces or commas; `#` begins a comment. Throws Error (kind input)
/// with file and line.
std::vector<CameraPose> read_poses(const std::string& path);

/// The pose of each frame, or none if it is unknown. If both have times, the nearest pose in time
/// (at most kMaxPoseDelay_s away), in any order; of equal times the first row counts. Otherwise row
/// by row. Throws Error (kind input) if neither works: no pose is near in time, or there are no
/// times and the numbers of rows differ.
std::vector<std::optional<CameraPose>> poses_of_frames(const std::vector<CameraPose>& poses,
                                                       const FrameTimes& times_s);

inline constexpr double kMaxPoseDelay_s = 0.05;

using Positions = std::vector<std::optional<cv::Vec3d>>;  ///< one per frame, if it is known

/// Camera centres from a file of poses, one per frame read. If poses and frames have times, they
/// are matched by time. Otherwise frame k is row k * every; further rows belong to a run that ended
/// early. If the frames are not known, all rows without times are returned. Throws Error (kind
/// input) as read_poses and poses_of_frames do, and if there are too few rows; (kind option) if
/// `every` is less than 1.
Positions read_positions(const std::string& path, FramesRead frames);

/// Throws what read_positions() would, as far as can be told before the `frames` are read, with
/// their number but without their times. If they are `all`, the file must not have more rows.
void check_poses(const std::string& path, const FramesRead& frames);

/// The rule by which two frames with known poses show the same place.
struct PoseTruthOptions {
  double radius_m = 6.0;
  int min_gap_frames = 150;
  double min_path_m = 0.0;
  double max_heading_deg = 180.0;
  double grey_radius_m = 0.0;

  static constexpr auto fields() {
    using S = PoseTruthOptions;
    return std::tuple{
        Field{"radius_m", &S::radius_m, 0.01, 1000.0, "same place: at most this far apart, m"},
        Field{"min_gap_frames", &S::min_gap_frames, 0, 1'000'000,
              "same place: more than this many frames apart"},
        Field{"min_path_m", &S::min_path_m, 0.0, 1e6,
              "same place: at least this much driven in between, m"},
        Field{"max_heading_deg", &S::max_heading_deg, 1.0, 180.0,
              "same place: viewing directions at most this far apart, degrees; 180 = any"},
        Field{"grey_radius_m", &S::grey_radius_m, 0.0, 1000.0,
              "a match up to this far away is not wrong, and right only by the rules above, m; 0 = "
              "none"}};
  }
};

/// The ground truth of poses: for each frame, the earlier frames that satisfy `options`. near_place
/// has those within the grey radius, whatever their heading, gap or path (and all of same_place).
/// Frames without a pose are unknown. The path is measured between frames with poses. Throws Error
/// (kind option) for an option out of range, (kind input) for a position that is not finite or over
/// 1e9 m, or for more than 5 million runs. Cost: grows with the runs of places within reach, not
/// with their frames: a camera that stands still costs little.
GroundTruth truth_from_poses(const std::vector<std::optional<CameraPose>>& poses,
                             const PoseTruthOptions& options = {});

}  // namespace loopbit
