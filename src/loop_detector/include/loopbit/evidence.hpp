// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/binary_content.hpp"

namespace loopbit {

/// One point in two images: x from 0 (left) to 1, y from 0 (top) to 1.
struct PointPair {
  cv::Point2f query;
  cv::Point2f match;

  bool operator==(const PointPair&) const = default;
};

/// The evidence for a detection, for display; see LoopDetector::process.
struct Evidence {
  BinaryContent content;
  cv::Mat1f saliency;              ///< 64 x 64
  std::vector<PointPair> inliers;  ///< of the frame and its match, accepted or not
};

}  // namespace loopbit
