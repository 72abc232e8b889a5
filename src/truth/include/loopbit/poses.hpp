// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/ground_truth.hpp"
#include "loopbit/options.hpp"

namespace loopbit {

using Positions = std::vector<std::optional<cv::Vec3d>>;  ///< one per frame, if it is known

/// Camera centres from a file of poses, one per frame read. A row is a KITTI pose (12 numbers:
/// camera to world, 3 x 4), a TUM pose (8: time, position, quaternion x y z w) or a EuRoC state
/// (17: time in ns, position, quaternion w x y z, 9 that are not read). If poses and frames have
/// times, they are matched by time, at most 0.05 s apart. Otherwise frame k is row k * every;
/// further rows belong to a run that ended early. If the frames are not known, all rows without
/// times are returned. Throws Error (kind input) for a malformed row, too few rows, or if no pose
/// is near in time; (kind option) if `every` is less than 1.
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

}  // namespace loopbit
