// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

namespace loopbit {

/// The long side of the pictures that runs and maps keep for people to look at.
inline constexpr int kPictureSide_px = 256;

/// A copy of `image`, of any type, halved until its long side is below 2 * kPictureSide_px: the
/// quick part of making a picture of it, and enough to let go of the image. Each pixel is the mean
/// of 2 x 2; an odd last row or column is left out. Cost: 0.1 ms for 1280 x 720 grey pixels.
cv::Mat halved_to_picture(const cv::Mat& image);

}  // namespace loopbit
