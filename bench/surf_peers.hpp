// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

#include "loopbit/surf.hpp"

namespace loopbit::bench {

/// dlib's SURF of `gray` as it is: the strongest `max_keypoints` whose descriptors lie within the
/// image, in our format.
Features dlib_surf(const cv::Mat1b& gray, int max_keypoints, bool upright);

}  // namespace loopbit::bench
