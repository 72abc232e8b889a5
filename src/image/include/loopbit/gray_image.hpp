// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

namespace loopbit {

/// Smaller images have too little content to recognise a place.
inline constexpr int kMinImageSidePx = 32;

/// Throws Error (kind input) unless `image` has 2 dimensions and at least 32 x 32 pixels.
void check_size(const cv::Mat& image);

/// Converts a camera image to the 8-bit grey image that all parts use.
///
/// `image`: 8- or 16-bit unsigned, grey, BGR or BGRA, at least 32 x 32. 16-bit images are stretched
/// so that their darkest and brightest thousandth become 0 and 255, because 12-bit and thermal
/// cameras use a small part of the 16 bits. An 8-bit grey image is returned without a copy. Throws
/// Error (kind input) for anything else, and names what was found.
cv::Mat1b gray_image(const cv::Mat& image);

}  // namespace loopbit
