// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "orb_matching.hpp"

#include <opencv2/features2d.hpp>

namespace loopbit::bench {

OrbFeatures orb(const cv::Mat1b& gray, int max_keypoints) {
  OrbFeatures features;
  cv::ORB::create(max_keypoints)
      ->detectAndCompute(gray, cv::noArray(), features.keypoints, features.descriptors);
  return features;
}

std::vector<Match> match_orb(const OrbFeatures& a, const OrbFeatures& b) {
  const cv::BFMatcher matcher(cv::NORM_HAMMING);
  std::vector<std::vector<cv::DMatch>> there;
  std::vector<std::vector<cv::DMatch>> back;
  matcher.knnMatch(a.descriptors, b.descriptors, there, 2);
  matcher.knnMatch(b.descriptors, a.descriptors, back, 2);
  const auto is_distinct = [](const std::vector<cv::DMatch>& two) {
    return two.size() == 2 && two[0].distance < 0.8F * two[1].distance;
  };
  std::vector<Match> matches;
  for (const auto& two : there) {
    if (!is_distinct(two)) continue;
    const auto& of_place = back[static_cast<std::size_t>(two[0].trainIdx)];
    if (!is_distinct(of_place) || of_place[0].trainIdx != two[0].queryIdx) continue;
    matches.push_back({two[0].queryIdx, two[0].trainIdx});
  }
  return matches;
}

Features positions_of(const OrbFeatures& orb) {
  Features features;
  for (const cv::KeyPoint& keypoint : orb.keypoints) {
    features.keypoints.push_back({.x_px = keypoint.pt.x, .y_px = keypoint.pt.y});
  }
  return features;
}

}  // namespace loopbit::bench
