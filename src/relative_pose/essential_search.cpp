// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "essential_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include <opencv2/calib3d.hpp>

#include "loopbit/verification.hpp"

namespace loopbit {
namespace {

constexpr int kSamples = 12;
constexpr std::size_t kSampleSize = 5;
/// Of the virtual pinhole images. What is further from the axis than 80 degrees is outside.
constexpr double kVirtualFocal_px = 500;
constexpr double kMinForward = 0.17;

cv::Vec2d on_plane(const cv::Vec3d& direction) {
  return {direction[0] / direction[2], direction[1] / direction[2]};
}

bool is_ahead(const RayPair& pair) {
  return pair.query.direction[2] > kMinForward && pair.match.direction[2] > kMinForward;
}

Keypoint virtual_keypoint(const cv::Vec3d& direction) {
  const cv::Vec2d at = on_plane(direction) * kVirtualFocal_px;
  return {.x_px = static_cast<float>(at[0]), .y_px = static_cast<float>(at[1])};
}

/// In virtual pixels, of a pair whose noise is usual.
double usual_spread_px(std::span<const RayPair> pairs) {
  std::vector<double> spreads;
  spreads.reserve(pairs.size());
  for (const RayPair& pair : pairs) {
    spreads.push_back(std::hypot(cv::norm(pair.query.spread), cv::norm(pair.match.spread)));
  }
  const auto middle = spreads.begin() + static_cast<std::ptrdiff_t>(spreads.size() / 2);
  std::nth_element(spreads.begin(), middle, spreads.end());
  return *middle * kVirtualFocal_px / std::sqrt(2.0);
}

/// The pairs that fit one fundamental matrix.
std::vector<RayPair> fundamental_inliers(std::span<const RayPair> pairs, double gate) {
  Features query;
  Features match;
  std::vector<Match> matches;
  std::vector<const RayPair*> sources;
  for (const RayPair& pair : pairs) {
    if (!is_ahead(pair)) continue;
    const int index = static_cast<int>(matches.size());
    matches.push_back({index, index});
    query.keypoints.push_back(virtual_keypoint(pair.query.direction));
    match.keypoints.push_back(virtual_keypoint(pair.match.direction));
    sources.push_back(&pair);
  }
  std::vector<RayPair> inliers;
  for (const Match& inlier :
       epipolar_inliers(query, match, matches, gate * usual_spread_px(pairs))) {
    inliers.push_back(*sources[static_cast<std::size_t>(inlier.query)]);
  }
  return inliers;
}

/// Five different numbers below n, the same for each run.
class Samples {
 public:
  explicit Samples(std::size_t n) : n_(n) {}

  std::array<std::size_t, kSampleSize> next() {
    std::array<std::size_t, kSampleSize> sample{};
    for (std::size_t i = 0; i < kSampleSize; ++i) {
      do {
        sample[i] = draw();
      } while (std::find(sample.begin(), sample.begin() + i, sample[i]) != sample.begin() + i);
    }
    return sample;
  }

 private:
  std::size_t draw() {  // xorshift64* by Vigna
    state_ ^= state_ >> 12U;
    state_ ^= state_ << 25U;
    state_ ^= state_ >> 27U;
    return static_cast<std::size_t>(((state_ * 0x2545f4914f6cdd1dU) >> 32U) * n_ >> 32U);
  }

  std::size_t n_;
  std::uint64_t state_ = 2019;
};

/// The up to ten essential matrices of five pairs, below each other.
cv::Mat1d five_point_matrices(const std::vector<RayPair>& pairs, Samples& samples) {
  std::array<cv::Point2d, kSampleSize> query;
  std::array<cv::Point2d, kSampleSize> match;
  std::size_t i = 0;
  for (const std::size_t index : samples.next()) {
    query[i] = on_plane(pairs[index].query.direction);
    match[i] = on_plane(pairs[index].match.direction);
    ++i;
  }
  // With as many points as unknowns this is the solver alone.
  constexpr double kUnused = 1.0;
  return cv::findEssentialMat(query, match, cv::Matx33d::eye(), cv::RANSAC, 0.999, kUnused);
}

double truncated_cost(const cv::Matx33d& essential, std::span<const RayPair> pairs, double gate) {
  double cost = 0;
  for (const RayPair& pair : pairs) {
    cost += std::min(epipolar_error_sq(pair, essential), gate * gate);
  }
  return cost;
}

/// Pairs that `pose` explains and whose point is before both cameras.
int points_before(const RigidPose& pose, const cv::Matx33d& essential,
                  std::span<const RayPair> pairs, double gate) {
  int count = 0;
  for (const RayPair& pair : pairs) {
    if (epipolar_error_sq(pair, essential) > gate * gate) continue;
    const cv::Vec3d u = pose.rotation * pair.query.direction;
    const cv::Vec3d& m = pair.match.direction;
    const cv::Vec3d normal = m.cross(u);
    const bool is_before_query = normal.dot(pose.translation.cross(m)) > 0;
    const bool is_before_match = normal.dot(pose.translation.cross(u)) > 0;
    count += is_before_query && is_before_match ? 1 : 0;
  }
  return count;
}

/// The homography from directions of the query to those of the match, by least squares.
cv::Matx33d fit_homography(std::span<const RayPair> pairs, const std::vector<char>& is_used) {
  cv::Matx<double, 9, 9> squares = cv::Matx<double, 9, 9>::zeros();
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (is_used[k] == 0) continue;
    const cv::Vec3d& q = pairs[k].query.direction;
    const cv::Vec3d& m = pairs[k].match.direction;
    // m x (H q) = 0 sums to (1 - m m^T) times q q^T.
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        const double of_match = (a == b ? 1.0 : 0.0) - m[a] * m[b];
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j) squares(a * 3 + i, b * 3 + j) += of_match * q[i] * q[j];
        }
      }
    }
  }
  cv::Matx<double, 9, 1> values;
  cv::Matx<double, 9, 9> vectors;
  cv::eigen(squares, values, vectors);
  return cv::Matx33d(vectors.val + std::ptrdiff_t{8} * 9);
}

/// How far `homography` leads from the match's direction, squared, in standard deviations.
double homography_error_sq(const RayPair& pair, const cv::Matx33d& homography) {
  const cv::Vec3d seen = cv::normalize(homography * pair.query.direction);
  const double angle_sq = cv::norm(seen.cross(pair.match.direction), cv::NORM_L2SQR);
  const double sigma_sq = (cv::norm(pair.query.spread, cv::NORM_L2SQR) +
                           cv::norm(pair.match.spread, cv::NORM_L2SQR)) /
                          2;
  return angle_sq / sigma_sq;
}

/// The homography of the plane on which nearly all pairs lie, of determinant above 0.
std::optional<cv::Matx33d> homography_of_plane(std::span<const RayPair> pairs, double gate) {
  constexpr int kRounds = 3;
  constexpr double kMinShare = 0.85;
  std::vector<char> is_used(pairs.size(), 1);
  cv::Matx33d homography;
  std::ptrdiff_t used = 0;
  for (int round = 0; round < kRounds; ++round) {
    homography = fit_homography(pairs, is_used);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      is_used[i] = homography_error_sq(pairs[i], homography) <= gate * gate ? 1 : 0;
    }
    used = std::ranges::count(is_used, 1);
    if (static_cast<double>(used) < 0.5 * static_cast<double>(pairs.size())) return std::nullopt;
  }
  if (static_cast<double>(used) < kMinShare * static_cast<double>(pairs.size())) {
    return std::nullopt;
  }
  return cv::determinant(homography) > 0 ? homography : homography * -1.0;
}

}  // namespace

RigidPose pose_before_cameras(const cv::Matx33d& essential, std::span<const RayPair> pairs,
                              double gate) {
  cv::Matx33d first;
  cv::Matx33d second;
  cv::Vec3d translation;
  cv::decomposeEssentialMat(essential, first, second, translation);
  RigidPose best;
  int most = -1;
  for (const cv::Matx33d& rotation : {first, second}) {
    for (const double sign : {1.0, -1.0}) {
      const RigidPose pose{rotation, translation * sign};
      const int count = points_before(pose, essential, pairs, gate);
      if (count <= most) continue;
      most = count;
      best = pose;
    }
  }
  return best;
}

std::optional<RigidPose> search_essential(std::span<const RayPair> pairs, double gate) {
  const std::vector<RayPair> inliers = fundamental_inliers(pairs, gate);
  if (inliers.size() < kSampleSize) return std::nullopt;
  Samples samples(inliers.size());
  std::optional<cv::Matx33d> best;
  double lowest = std::numeric_limits<double>::max();
  for (int i = 0; i < kSamples; ++i) {
    const cv::Mat1d matrices = five_point_matrices(inliers, samples);
    for (int row = 0; row + 3 <= matrices.rows; row += 3) {
      const cv::Matx33d essential(matrices.ptr<double>(row));
      const double cost = truncated_cost(essential, pairs, gate);
      if (!(cost < lowest)) continue;
      lowest = cost;
      best = essential;
    }
  }
  if (!best) return std::nullopt;
  return pose_before_cameras(*best, pairs, gate);
}

std::optional<RigidPose> other_pose_of_plane(std::span<const RayPair> pairs, const RigidPose& pose,
                                             double gate) {
  const auto homography = homography_of_plane(pairs, gate);
  if (!homography) return std::nullopt;
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  std::vector<cv::Mat> normals;
  cv::decomposeHomographyMat(*homography, cv::Matx33d::eye(), rotations, translations, normals);
  std::optional<RigidPose> other;
  double farthest = 0;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const cv::Vec3d translation(translations[i].ptr<double>());
    const cv::Vec3d normal(normals[i].ptr<double>());
    const bool is_seen = std::ranges::all_of(
        pairs, [&](const RayPair& pair) { return normal.dot(pair.query.direction) > 0; });
    if (!is_seen || cv::norm(translation) == 0) continue;
    const RigidPose candidate{cv::Matx33d(rotations[i].ptr<double>()), cv::normalize(translation)};
    const double apart = cv::norm(candidate.translation - pose.translation) +
                         cv::norm(candidate.rotation - pose.rotation);
    if (apart > farthest) {
      farthest = apart;
      other = candidate;
    }
  }
  constexpr double kMinApart = 0.05;
  return farthest > kMinApart ? other : std::nullopt;
}

}  // namespace loopbit
