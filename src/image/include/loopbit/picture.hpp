// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

namespace loopbit {

/// The range of grey levels of a 16-bit image, without its darkest and its brightest thousandth.
struct GrayRange {
  int dark = 0;
  int bright = 65535;  ///< more than `dark`
};

/// `image`: 16-bit grey, not empty.
GrayRange gray_range(const cv::Mat1w& image);

/// Long side of the pictures that runs and maps keep for people.
inline constexpr int kPictureSide_px = 256;

/// A copy of `image`, of any type, halved until its long side is below 2 * kPictureSide_px. This is
/// the fast first part of making a picture; afterwards the image is no longer needed. Each pixel is
/// the mean of 2 x 2 pixels; an odd last row or column is dropped. Cost: 0.1 ms for 1280 x 720 grey
/// pixels.
cv::Mat halved_to_picture(const cv::Mat& image);

}  // namespace loopbit
