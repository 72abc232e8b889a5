// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

namespace loopbit::bench {

/// What ORB has to be compared with: 1000 keypoints.
inline constexpr int kOrbKeypoints = 1000;

/// The image at the size at which SURF looks at it.
cv::Mat1b working_image(const cv::Mat1b& gray);

/// OpenCV's ORB with its defaults but for the number of keypoints.
struct OrbFeatures {
  Features positions;  ///< without descriptors of their own, for the geometry
  cv::Mat descriptors;
};
OrbFeatures orb(const cv::Mat1b& gray);

/// Mutual matches that pass the ratio test from either side, as match_features has them, and that
/// one epipolar geometry explains.
std::vector<Match> orb_inliers(const OrbFeatures& a, const OrbFeatures& b);

}  // namespace loopbit::bench
