// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

namespace loopbit::bench {

/// OpenCV's ORB with its defaults but for the number of keypoints.
struct OrbFeatures {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
};
OrbFeatures orb(const cv::Mat1b& gray, int max_keypoints);

/// Mutual matches that pass the ratio test from either side, as match_features has them.
std::vector<Match> match_orb(const OrbFeatures& a, const OrbFeatures& b);

/// Features without descriptors, for their geometry.
Features positions_of(const OrbFeatures& orb);

}  // namespace loopbit::bench
