// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "essential_search.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <opencv2/calib3d.hpp>

#include "loopbit/median.hpp"
#include "loopbit/ray_geometry.hpp"
#include "loopbit/verification.hpp"

namespace loopbit {
namespace {

constexpr int kDirections = 64;
constexpr std::size_t kDrawnPairs = 16;
constexpr std::size_t kRefined = 12;
constexpr int kStepsOfDrawn = 8;
constexpr std::size_t kMinInliers = 8;
/// Before the pose is nearly right, pairs far from it count, too.
constexpr double kWideGate = 1e3;
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
  return median(std::move(spreads)) * kVirtualFocal_px / std::sqrt(2.0);
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

/// Some of `count` pairs, by chance.
std::vector<std::size_t> drawn(std::size_t count, cv::RNG& chance) {
  std::vector<std::size_t> result(kDrawnPairs);
  for (std::size_t& index : result) {
    index = static_cast<std::size_t>(chance.uniform(0, static_cast<int>(count)));
  }
  return result;
}

/// Pairs whose point is before both cameras.
int points_before(const RigidPose& pose, std::span<const RayPair> pairs) {
  int count = 0;
  for (const RayPair& pair : pairs) {
    const cv::Vec3d u = pose.rotation * pair.query.direction;
    const cv::Vec3d& m = pair.match.direction;
    const cv::Vec3d normal = m.cross(u);
    const bool is_before_query = normal.dot(pose.translation.cross(m)) > 0;
    const bool is_before_match = normal.dot(pose.translation.cross(u)) > 0;
    count += is_before_query && is_before_match ? 1 : 0;
  }
  return count;
}

/// The fit, of the one of the four poses of its essential matrix that puts most of the points
/// before both cameras.
PoseFit before_cameras(const PoseFit& fit, std::span<const RayPair> pairs, double gate) {
  const cv::Matx33d essential = essential_matrix(fit.pose);
  std::vector<RayPair> inliers;
  std::ranges::copy_if(pairs, std::back_inserter(inliers), [&](const RayPair& pair) {
    return epipolar_error_sq(pair, essential) <= gate * gate;
  });
  cv::Matx33d first;
  cv::Matx33d second;
  cv::Vec3d translation;
  cv::decomposeEssentialMat(essential, first, second, translation);
  PoseFit best = fit;
  int most = -1;
  for (const cv::Matx33d& rotation : {first, second}) {
    for (const double sign : {1.0, -1.0}) {
      const RigidPose pose{rotation, translation * sign};
      const int count = points_before(pose, inliers);
      if (count <= most) continue;
      most = count;
      best.pose = pose;
    }
  }
  return best;
}

/// Whether two poses lie in one minimum of the cost.
bool are_alike(const RigidPose& a, const RigidPose& b) {
  constexpr double kTranslation = 0.1;
  constexpr double kRotation = 0.03;
  return cv::norm(a.translation.cross(b.translation)) < kTranslation &&
         cv::norm(a.rotation - b.rotation) < kRotation;
}

bool are_among(std::span<const PoseFit> fits, const RigidPose& pose) {
  return std::ranges::any_of(fits, [&](const PoseFit& fit) { return are_alike(pose, fit.pose); });
}

/// The homography from directions of the query to those of the match, by least squares.
cv::Matx33d fit_homography(std::span<const RayPair> pairs, const std::vector<char>& is_used) {
  cv::Matx<double, 9, 9> squares = cv::Matx<double, 9, 9>::zeros();
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (is_used[k] == 0) continue;
    const cv::Vec3d& q = pairs[k].query.direction;
    const cv::Vec3d& m = pairs[k].match.direction;
    // m x (H q) = 0 sums to (1 - m m^T) times q q^T.
    const cv::Matx33d of_match = cv::Matx33d::eye() - m * m.t();
    const cv::Matx33d of_query = q * q.t();
    for (int row = 0; row < 9; ++row) {
      for (int column = 0; column < 9; ++column) {
        squares(row, column) += of_match(row / 3, column / 3) * of_query(row % 3, column % 3);
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
  const double sigma_sq =
      (cv::norm(pair.query.spread, cv::NORM_L2SQR) + cv::norm(pair.match.spread, cv::NORM_L2SQR)) /
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
    if (2 * used < std::ssize(pairs)) return std::nullopt;
  }
  const auto needed = kMinShare * static_cast<double>(pairs.size());
  if (static_cast<double>(used) < needed) return std::nullopt;
  return cv::determinant(homography) > 0 ? homography : homography * -1.0;
}

}  // namespace

cv::Matx33d rotation_between(std::span<const RayPair> pairs) {
  cv::Matx33d sum = cv::Matx33d::zeros();
  for (const RayPair& pair : pairs) sum += pair.match.direction * pair.query.direction.t();
  return best_rotation(sum);
}

std::optional<DirectionSearch> search_direction(std::span<const RayPair> pairs, double gate) {
  const std::vector<RayPair> inliers = fundamental_inliers(pairs, gate);
  if (inliers.size() < kMinInliers) return std::nullopt;
  const cv::Matx33d rotation = rotation_between(inliers);
  const RayBlocks all(pairs);
  const RayBlocks likely(inliers);
  std::vector<std::pair<double, RigidPose>> found;
  cv::RNG chance(1);
  for (const cv::Vec3d& direction : half_sphere(kDirections)) {
    const RayBlocks few(likely, drawn(likely.size(), chance));
    const RigidPose pose = fit_direction(few, {rotation, direction}, kWideGate, kStepsOfDrawn).pose;
    found.emplace_back(cost_of(all, pose, gate), pose);
  }
  std::ranges::sort(found, {}, &std::pair<double, RigidPose>::first);
  // The best of those that differ, on all pairs.
  std::vector<PoseFit> refined;
  std::vector<PoseFit> fits;
  for (const auto& candidate : found) {
    const RigidPose& start = candidate.second;
    if (are_among(refined, start)) continue;
    refined.push_back({start});
    fits.push_back(fit_direction(all, start, gate));
    if (refined.size() == kRefined) break;
  }
  std::ranges::sort(fits, {}, &PoseFit::cost);
  DirectionSearch result{before_cameras(fits.front(), pairs, gate), {}};
  for (const PoseFit& fit : std::span(fits).subspan(1)) {
    if (are_among(result.rivals, fit.pose)) continue;
    result.rivals.push_back(before_cameras(fit, pairs, gate));
  }
  return result;
}

std::optional<PoseFit> rival_of_plane(std::span<const RayPair> pairs, const PoseFit& fit,
                                      double gate) {
  const auto homography = homography_of_plane(pairs, gate);
  if (!homography) return std::nullopt;
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  std::vector<cv::Mat> normals;
  cv::decomposeHomographyMat(*homography, cv::Matx33d::eye(), rotations, translations, normals);
  std::optional<PoseFit> rival;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const cv::Vec3d normal(normals[i].ptr<double>());
    const bool is_seen = std::ranges::all_of(
        pairs, [&](const RayPair& pair) { return normal.dot(pair.query.direction) > 0; });
    const cv::Vec3d translation(translations[i].ptr<double>());
    if (!is_seen || !(cv::norm(translation) > 0)) continue;
    const RigidPose start{cv::Matx33d(rotations[i].ptr<double>()), cv::normalize(translation)};
    const PoseFit other = fit_pose(pairs, start, FitKind::direction, gate);
    if (are_alike(other.pose, fit.pose)) continue;
    if (!rival || other.cost < rival->cost) rival = other;
  }
  return rival;
}

}  // namespace loopbit
