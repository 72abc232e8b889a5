// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <opencv2/core.hpp>

namespace loopbit {

/// The absolute trajectory error: the root mean square distance of positions from true ones, in
/// metres, after the rotation and translation that minimize it (Horn 1987; evo_ape with --align, no
/// scale). Both have the same size; fewer than 3 positions have an error of 0. Throws Error (kind
/// option) if the sizes differ.
double absolute_trajectory_error_m(std::span<const cv::Vec3d> positions_m,
                                   std::span<const cv::Vec3d> truth_m);

}  // namespace loopbit
