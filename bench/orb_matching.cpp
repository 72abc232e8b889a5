// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "orb_matching.hpp"

#include <cmath>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace loopbit::bench {

namespace {

std::vector<Match> matches(const cv::Mat& a, const cv::Mat& b) {
  if (a.empty() || b.empty()) return {};  // a blank wall has no corners
  const cv::BFMatcher matcher(cv::NORM_HAMMING);
  std::vector<std::vector<cv::DMatch>> there;
  std::vector<std::vector<cv::DMatch>> back;
  matcher.knnMatch(a, b, there, 2);
  matcher.knnMatch(b, a, back, 2);
  const auto is_distinct = [](const std::vector<cv::DMatch>& two) {
    return two.size() == 2 && two[0].distance < 0.8F * two[1].distance;
  };
  std::vector<Match> mutual;
  for (const auto& two : there) {
    if (!is_distinct(two)) continue;
    const auto& of_place = back[static_cast<std::size_t>(two[0].trainIdx)];
    if (!is_distinct(of_place) || of_place[0].trainIdx != two[0].queryIdx) continue;
    mutual.push_back({two[0].queryIdx, two[0].trainIdx});
  }
  return mutual;
}

}  // namespace

cv::Mat1b working_image(const cv::Mat1b& gray) {
  const double scale =
      std::sqrt(SurfOptions().working_area_px / (static_cast<double>(gray.cols) * gray.rows));
  cv::Mat1b scaled;
  cv::resize(gray, scaled, {}, scale, scale, scale < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
  return scaled;
}

OrbFeatures orb(const cv::Mat1b& gray) {
  OrbFeatures features;
  std::vector<cv::KeyPoint> keypoints;
  cv::ORB::create(kOrbKeypoints)
      ->detectAndCompute(gray, cv::noArray(), keypoints, features.descriptors);
  for (const cv::KeyPoint& keypoint : keypoints) {
    features.positions.keypoints.push_back({.x_px = keypoint.pt.x, .y_px = keypoint.pt.y});
  }
  return features;
}

std::vector<Match> orb_inliers(const OrbFeatures& a, const OrbFeatures& b) {
  const double error_px = VerificationOptions().max_epipolar_error_px;
  return epipolar_inliers(a.positions, b.positions, matches(a.descriptors, b.descriptors),
                          error_px);
}

}  // namespace loopbit::bench
