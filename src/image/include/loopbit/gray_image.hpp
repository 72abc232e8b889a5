// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

namespace loopbit {

/// Images narrower or lower than this hold too little to recognise a place by.
inline constexpr int kMinImageSidePx = 32;

/// Throws Error (kind input) unless `image` has 2 dimensions and at least 32 x 32 pixels.
void check_size(const cv::Mat& image);

/// The grey levels between which all but the darkest and the brightest thousandth of a 16-bit image
/// lie.
struct GrayRange {
  int dark = 0;
  int bright = 65535;  ///< more than `dark`
};

/// `image`: 16-bit grey, not empty.
GrayRange gray_range(const cv::Mat1w& image);

/// The 8-bit grey picture of any camera image, which all parts work on.
///
/// `image`: 8- or 16-bit unsigned, grey, BGR or BGRA, at least 32 x 32. 16-bit images are stretched
/// so that their darkest and brightest thousandth meet 0 and 255: a 12-bit camera or a thermal one
/// uses a small part of the 16 bits. An 8-bit grey image is returned as it is, without a copy.
/// Throws Error (kind input) that names what was found, for anything else.
cv::Mat1b gray_image(const cv::Mat& image);

}  // namespace loopbit
