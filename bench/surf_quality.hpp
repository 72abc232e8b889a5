// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

namespace loopbit::bench {

/// Prints repeatability and inliers of our SURF, dlib's and ORB on pairs of real images.
///
/// Repeatability, where a homography is known: the part of the keypoints of either image that meet
/// one of the other one to one within 2 px, of the fewer that lie in the common view. Inliers:
/// after mutual matches with the ratio 0.8 from either side and our RANSAC at 2 px. All at the
/// working size; as many keypoints from dlib as from us, 1000 from ORB.
void print_quality(const std::filesystem::path& data);

}  // namespace loopbit::bench
