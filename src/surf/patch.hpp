// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include "loopbit/surf.hpp"

#include "integral_image.hpp"
#include "surf_kernels.hpp"

namespace loopbit {

/// A descriptor's patch reaches this many scales from its keypoint, along its own axes.
inline constexpr double kPatchReachScales = kPatchCells / 2.0;

/// Mean grey levels of 21 x 21 cells, a scale wide each, as they lie in memory.
using Patch = std::array<float, kCellsInMemory>;

/// The cells around an upright keypoint; their edges are rounded to pixels. The patch must lie
/// within the image.
void upright_patch(const IntegralImage& integral, const Keypoint& keypoint,
                   const SurfKernels& kernels, Patch& patch);

/// The cells along the axes that are turned by the keypoint's angle: squares parallel to the image
/// around their middles.
void turned_patch(const IntegralImage& integral, const Keypoint& keypoint, Patch& patch);

/// The dominant direction of the gradients around a keypoint, in radians (Bay et al. 2008, section
/// 4.1); x right, y down. Their wavelets are 4 scales long and 2 wide, not 4 x 4, and their edges
/// not rounded to pixels: a turned image then turns the direction better.
float dominant_angle(const IntegralImage& integral, const Keypoint& keypoint);

}  // namespace loopbit
