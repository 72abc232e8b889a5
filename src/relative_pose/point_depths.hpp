// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include "loopbit/relative_pose.hpp"
#include "loopbit/verification.hpp"

#include "ray_pairs.hpp"

namespace loopbit {

/// Sets the inverse depth of each pair whose keypoint of the match has one in `depth_m`. Where the
/// depth changes within a pixel's neighbours, it belongs to either side, and is not used.
void set_depths(const PoseView& match, const cv::Mat1f& depth_m, double error_share,
                std::vector<RayPair>& pairs);

/// Sets the inverse depth of each pair whose keypoint of the match is seen in `beside`, too, by
/// triangulation with the known poses. Several views must agree. The standard deviation is that of
/// the keypoints; the poses count as exact. Throws Error (kind input) for a pose that is not rigid.
void triangulate(const PoseView& match, std::span<const NearbyView> beside, double gate,
                 Verifier& verifier, std::vector<RayPair>& pairs);

/// The longest baseline between the match and a view beside it, m.
double longest_baseline_m(std::span<const NearbyView> beside);

}  // namespace loopbit
