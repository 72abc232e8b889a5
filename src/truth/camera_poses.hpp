// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/ground_truth.hpp"
#include "loopbit/poses.hpp"

namespace loopbit {

/// Position and viewing direction of a camera in the world frame.
struct CameraPose {
  std::optional<double> timestamp_s;  ///< if the file has times
  cv::Vec3d position_m;
  cv::Vec3d ahead;  ///< the viewing direction (the camera's z axis), unit length
};

/// The poses of read_trajectory(). Throws as it does.
std::vector<CameraPose> read_poses(const std::string& path);

/// The pose of each frame, or none if it is unknown. If both have times, the nearest pose in time
/// (at most RowsByTime::kMaxDelay_s away), in any order; of equal times the first row counts.
/// Otherwise row by row. Throws Error (kind input) if neither works: no pose is near in time, or
/// there are no times and the numbers of rows differ.
std::vector<std::optional<CameraPose>> poses_of_frames(const std::vector<CameraPose>& poses,
                                                       const FrameTimes& times_s);

/// The ground truth of poses: for each frame, the earlier frames that satisfy `options`. near_place
/// has those within the grey radius, whatever their heading, gap or path (and all of same_place).
/// Frames without a pose are unknown. The path is measured between frames with poses. Throws Error
/// (kind option) for an option out of range, (kind input) for a position that is not finite or over
/// 1e9 m, or for more than 5 million runs. Cost: grows with the runs of places within reach, not
/// with their frames: a camera that stands still costs little.
GroundTruth truth_from_poses(const std::vector<std::optional<CameraPose>>& poses,
                             const PoseTruthOptions& options = {});

}  // namespace loopbit
