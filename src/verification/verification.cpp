// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/verification.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include <opencv2/calib3d.hpp>

#include "loopbit/kernels.hpp"

#include "epipolar_ransac.hpp"
#include "feature_matcher.hpp"

namespace loopbit {
namespace {

/// Seven matches always have an epipolar geometry, so only more can speak for one.
constexpr std::size_t kMinMatchesForGeometry = 8;

const Keypoint& keypoint(const Features& features, int index) {
  return features.keypoints[static_cast<std::size_t>(index)];
}

std::vector<Match> ransac_inliers(const Features& query, const Features& place,
                                  const std::vector<Match>& matches, double max_error_px) {
  std::vector<EpipolarRansac::Pair> pairs;
  pairs.reserve(matches.size());
  for (const Match& match : matches) {
    const Keypoint& a = keypoint(query, match.query);
    const Keypoint& b = keypoint(place, match.place);
    pairs.push_back({a.x_px, a.y_px, b.x_px, b.y_px});
  }
  EpipolarRansac ransac;
  ransac.find(pairs, max_error_px);
  std::vector<Match> inliers;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (ransac.is_inlier()[i] != 0) inliers.push_back(matches[i]);
  }
  return inliers;
}

/// The matches that a camera standing where it stood would see: a geometry, too, but one that no
/// fundamental matrix is determined by, so that RANSAC finds none.
std::vector<Match> unmoved_matches(const Features& query, const Features& place,
                                   std::vector<Match> matches, double max_error_px) {
  std::erase_if(matches, [&](const Match& match) {
    const Keypoint& a = keypoint(query, match.query);
    const Keypoint& b = keypoint(place, match.place);
    return std::hypot(a.x_px - b.x_px, a.y_px - b.y_px) > max_error_px;
  });
  return matches;
}

bool overlap(const Keypoint& a, const Keypoint& b, double min_spacing_scales) {
  const double dx = a.x_px - b.x_px;
  const double dy = a.y_px - b.y_px;
  const double spacing = min_spacing_scales * std::min(a.scale, b.scale);
  return dx * dx + dy * dy < spacing * spacing;
}

}  // namespace

std::vector<Match> match_features(const Features& query, const Features& place, double max_ratio) {
  std::vector<Match> matches;
  FeatureMatcher(active_kernels()).match(query, place, max_ratio, matches);
  return matches;
}

std::vector<Match> epipolar_inliers(const Features& query, const Features& place,
                                    const std::vector<Match>& matches, double max_error_px) {
  if (matches.size() < kMinMatchesForGeometry) return {};
  auto moved = ransac_inliers(query, place, matches, max_error_px);
  auto unmoved = unmoved_matches(query, place, matches, max_error_px);
  return unmoved.size() > moved.size() ? unmoved : moved;
}

int distinct_inliers(const Features& query, const Features& place,
                     const std::vector<Match>& inliers, double min_spacing_scales) {
  const auto repeats = [&](const Match& a, const Match& b) {
    return overlap(keypoint(query, a.query), keypoint(query, b.query), min_spacing_scales) ||
           overlap(keypoint(place, a.place), keypoint(place, b.place), min_spacing_scales);
  };
  std::vector<Match> distinct;
  for (const Match& match : inliers) {
    const bool is_new = std::none_of(distinct.begin(), distinct.end(),
                                     [&](const Match& other) { return repeats(match, other); });
    if (is_new) distinct.push_back(match);
  }
  return static_cast<int>(distinct.size());
}

Verification verify(const Features& query, const Features& place,
                    const VerificationOptions& options) {
  validate(options, "verification");
  Verification result;
  result.matches = match_features(query, place, options.max_ratio);
  if (result.matches.size() < static_cast<std::size_t>(options.min_matches)) return result;
  result.inliers = epipolar_inliers(query, place, result.matches, options.max_epipolar_error_px);
  result.distinct_inliers =
      distinct_inliers(query, place, result.inliers, options.min_spacing_scales);
  return result;
}

}  // namespace loopbit
