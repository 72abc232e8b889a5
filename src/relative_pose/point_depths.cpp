// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "point_depths.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "loopbit/error.hpp"

#include "pose_fit.hpp"

namespace loopbit {
namespace {

/// Triangulated points of a larger standard deviation (share of the inverse depth) are hardly
/// better than their directions, and half of the wrong ones.
constexpr double kMaxDepthError = 0.25;

/// The fields of RayPair.
struct InverseDepth {
  double value = 0;
  double sigma = 0;
  cv::Vec2d by_match;

  [[nodiscard]] double variance() const { return sigma * sigma + by_match.dot(by_match); }
};

cv::Vec3d translation_of(const cv::Matx44d& transform) {
  return {transform(0, 3), transform(1, 3), transform(2, 3)};
}

RigidPose rigid_pose(const cv::Matx44d& transform) {
  const cv::Matx33d rotation = transform.get_minor<3, 3>(0, 0);
  constexpr double kMaxError = 0.001;
  const bool is_rigid = cv::checkRange(transform) &&
                        cv::norm(rotation * rotation.t() - cv::Matx33d::eye()) < kMaxError &&
                        cv::determinant(rotation) > 0;
  if (is_rigid) return {rotation, translation_of(transform)};
  throw Error(ErrorKind::input,
              "T_match_view of a view beside the match is not a rotation and a translation; give a "
              "rigid transform in metres.");
}

/// The depth at a keypoint, and 0 where it is not known or where there is an edge.
double depth_at(const cv::Mat1f& depth_m, const PoseView& match, int keypoint) {
  const Keypoint& at = match.features->keypoint(keypoint);
  const cv::Size working = match.features->working_size_px;
  const int x =
      static_cast<int>((static_cast<double>(at.x_px) + 0.5) * depth_m.cols / working.width);
  const int y =
      static_cast<int>((static_cast<double>(at.y_px) + 0.5) * depth_m.rows / working.height);
  if (x < 1 || y < 1 || x + 1 >= depth_m.cols || y + 1 >= depth_m.rows) return 0;
  float nearest = depth_m(y, x);
  float farthest = nearest;
  for (int row = y - 1; row <= y + 1; ++row) {
    for (int column = x - 1; column <= x + 1; ++column) {
      const float depth = depth_m(row, column);
      if (!(depth > 0) || !std::isfinite(depth)) return 0;
      nearest = std::min(nearest, depth);
      farthest = std::max(farthest, depth);
    }
  }
  constexpr float kMaxStep = 1.1F;
  return farthest <= kMaxStep * nearest ? static_cast<double>(depth_m(y, x)) : 0.0;
}

/// Of the point that two rays see. `pair.query` is the ray of the view beside. The view sees it at
/// v(w) = R^T (m - w t): the w that brings v(w) nearest to its ray follows from the cross product.
std::optional<InverseDepth> meeting_point(const RayPair& pair, const RigidPose& view, double gate) {
  if (epipolar_error_sq(pair, essential_matrix(view)) > gate * gate) return std::nullopt;
  const cv::Matx33d back = view.rotation.t();
  const cv::Vec3d at_infinity = back * pair.match.direction;
  const cv::Vec3d step = back * view.translation;
  const cv::Vec3d& v = pair.query.direction;
  const cv::Vec3d crossed_step = v.cross(step);
  const double parallax_sq = crossed_step.dot(crossed_step);
  if (!(parallax_sq > 0)) return std::nullopt;
  const double inverse_depth = v.cross(at_infinity).dot(crossed_step) / parallax_sq;
  const cv::Vec3d seen = at_infinity - inverse_depth * step;
  if (seen.dot(v) <= 0) return std::nullopt;
  // How the noise of both rays along the epipolar line moves w.
  const double stretch = 1 / std::sqrt(parallax_sq);
  const cv::Vec3d along = cv::normalize(crossed_step.cross(v));
  const double of_view = cv::norm(pair.query.spread.t() * along) * cv::norm(seen);
  return InverseDepth{inverse_depth, of_view * stretch,
                      pair.match.spread.t() * (view.rotation * along) * stretch};
}

/// Estimates of several views, weighted; none if they contradict.
std::optional<InverseDepth> fused(const std::vector<InverseDepth>& estimates) {
  InverseDepth mean;
  double weights = 0;
  for (const InverseDepth& each : estimates) {
    const double weight = 1 / each.variance();
    weights += weight;
    mean.value += weight * each.value;
    mean.by_match += weight * each.by_match;
    mean.sigma += weight * weight * each.sigma * each.sigma;
  }
  mean = {mean.value / weights, std::sqrt(mean.sigma) / weights, mean.by_match / weights};
  constexpr double kGate = 3;
  const bool agree = std::ranges::all_of(estimates, [&](const InverseDepth& each) {
    return std::abs(each.value - mean.value) <= kGate * std::sqrt(each.variance());
  });
  if (!agree) return std::nullopt;
  return mean;
}

}  // namespace

void set_depths(const PoseView& match, const cv::Mat1f& depth_m, double error_share,
                std::vector<RayPair>& pairs) {
  for (RayPair& pair : pairs) {
    const double depth_along_z = depth_at(depth_m, match, pair.features.place);
    if (!(depth_along_z > 0) || !(pair.match.direction[2] > 0)) continue;
    pair.inverse_depth = pair.match.direction[2] / depth_along_z;
    pair.inverse_depth_sigma = error_share * pair.inverse_depth;
  }
}

void triangulate(const PoseView& match, std::span<const NearbyView> beside, double gate,
                 Verifier& verifier, std::vector<RayPair>& pairs) {
  std::map<int, RayPair*> by_feature;
  for (RayPair& pair : pairs) by_feature.emplace(pair.features.place, &pair);
  std::vector<int> asked;
  asked.reserve(by_feature.size());
  for (const auto& [feature, pair] : by_feature) asked.push_back(feature);
  std::map<int, std::vector<InverseDepth>> estimates;
  Verification seen;
  for (const NearbyView& nearby : beside) {
    const RigidPose pose = rigid_pose(nearby.T_match_view);
    verifier.match_some(*match.features, asked, *nearby.view.features, seen);
    for (const Match& found : seen.matches) {
      const auto ray = ray_of(nearby.view, found.place);
      if (!ray) continue;
      const RayPair meeting{.query = *ray, .match = by_feature.at(found.query)->match};
      const auto depth = meeting_point(meeting, pose, gate);
      if (depth) estimates[found.query].push_back(*depth);
    }
  }
  for (const auto& [feature, of_views] : estimates) {
    const auto depth = fused(of_views);
    if (!depth || !(std::sqrt(depth->variance()) < kMaxDepthError * depth->value)) continue;
    RayPair& pair = *by_feature.at(feature);
    pair.inverse_depth = depth->value;
    pair.inverse_depth_sigma = depth->sigma;
    pair.inverse_depth_by_match = depth->by_match;
  }
}

double longest_baseline_m(std::span<const NearbyView> beside) {
  double longest = 0;
  for (const NearbyView& nearby : beside) {
    longest = std::max(longest, cv::norm(translation_of(nearby.T_match_view)));
  }
  return longest;
}

}  // namespace loopbit
