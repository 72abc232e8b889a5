// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "essential_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "loopbit/ray_geometry.hpp"

namespace loopbit {
namespace {

/// Starting points are tried on so many pairs.
constexpr std::size_t kFewPairs = 40;
constexpr int kStarts = 8;
constexpr int kFirstSteps = 6;
constexpr int kLastSteps = 10;

/// Of the nearest essential matrix. Of its four motions any will do: all have the same matrix.
ViewMotion nearest_motion(const cv::Matx33d& model) {
  cv::Matx31d values;
  cv::Matx33d u;
  cv::Matx33d v_t;
  cv::SVD::compute(model, values, u, v_t);
  if (cv::determinant(u) < 0) u *= -1.0;
  if (cv::determinant(v_t) < 0) v_t *= -1.0;
  const cv::Matx33d quarter_turn(0, -1, 0, 1, 0, 0, 0, 0, 1);
  return {u * quarter_turn * v_t, {u(0, 2), u(1, 2), u(2, 2)}};
}

/// The rotation that best turns the first rays into the second ones (Kabsch 1976).
cv::Matx33d rotation_between(std::span<const ViewRayPair> pairs) {
  cv::Matx33d sum = cv::Matx33d::zeros();
  for (const ViewRayPair& pair : pairs) {
    sum += cv::Vec3d(pair.second.direction) * cv::Vec3d(pair.first.direction).t();
  }
  return best_rotation(sum);
}

/// J^T W J, J^T W r and the robust cost, for a motion (x, y, z, rx, ry, rz).
struct Equations {
  cv::Matx66d squares = cv::Matx66d::zeros();
  cv::Vec6d gradient;
  double cost = 0;
};

Equations equations_of(std::span<const ViewRayPair> pairs, const ViewMotion& motion,
                       double huber_px) {
  Equations sum;
  for (const ViewRayPair& pair : pairs) {
    const cv::Vec3d turned = motion.rotation * cv::Vec3d(pair.first.direction);
    const cv::Vec3d second = pair.second.direction;
    const cv::Vec3d normal = motion.translation.cross(turned);
    const cv::Vec3d other = second.cross(motion.translation);
    const double sigma_sq =
        pair.second.spread_sq * normal.dot(normal) + pair.first.spread_sq * other.dot(other);
    if (!(sigma_sq > 0)) continue;
    const double scale = 1 / std::sqrt(sigma_sq);
    const double error = second.dot(normal) * scale;
    const double size = std::abs(error);
    const bool is_near = size <= huber_px;
    const double weight = is_near ? 1 : huber_px / size;
    sum.cost += is_near ? size * size : huber_px * (2 * size - huber_px);
    const cv::Vec3d by_translation = turned.cross(second) * scale;
    const cv::Vec3d by_rotation = turned.cross(other) * scale;
    const std::array<double, 6> jacobian{by_translation[0], by_translation[1], by_translation[2],
                                         by_rotation[0],    by_rotation[1],    by_rotation[2]};
    for (int a = 0; a < 6; ++a) {
      const double weighted = weight * jacobian[static_cast<std::size_t>(a)];
      sum.gradient[a] += weighted * error;
      for (int b = 0; b <= a; ++b) {
        sum.squares(a, b) += weighted * jacobian[static_cast<std::size_t>(b)];
      }
    }
  }
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < a; ++b) sum.squares(b, a) = sum.squares(a, b);
  }
  return sum;
}

/// The translation keeps its length.
ViewMotion stepped(const ViewMotion& motion, const Equations& at, double damping) {
  cv::Matx66d squares = at.squares;
  const double size = std::max(cv::trace(squares), 1e-12);
  for (int a = 0; a < 6; ++a) squares(a, a) *= 1 + damping;
  for (int a = 0; a < 6; ++a) squares(a, a) += 1e-9 * size;
  const cv::Vec3d& t = motion.translation;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) squares(a, b) += size * t[a] * t[b];
  }
  const cv::Vec6d step = squares.inv(cv::DECOMP_CHOLESKY) * at.gradient * -1.0;
  return {rotation_by({step[3], step[4], step[5]}) * motion.rotation,
          cv::normalize(t + cv::Vec3d(step[0], step[1], step[2]))};
}

/// Levenberg and Marquardt's method; returns the cost.
double descend(std::span<const ViewRayPair> pairs, int max_steps, double huber_px,
               ViewMotion& motion) {
  Equations at = equations_of(pairs, motion, huber_px);
  double damping = 1e-3;
  for (int step = 0; step < max_steps; ++step) {
    const ViewMotion next = stepped(motion, at, damping);
    const Equations there = equations_of(pairs, next, huber_px);
    if (!(there.cost < at.cost)) {
      if (damping > 1) break;
      damping *= 100;
      continue;
    }
    const bool is_done = at.cost - there.cost < 1e-3 * at.cost;
    motion = next;
    at = there;
    damping = std::max(damping / 10, 1e-6);
    if (is_done) break;
  }
  return at.cost;
}

std::vector<ViewRayPair> thinned(std::span<const ViewRayPair> pairs) {
  if (pairs.size() <= kFewPairs) return {pairs.begin(), pairs.end()};
  std::vector<ViewRayPair> few;
  few.reserve(kFewPairs);
  for (std::size_t i = 0; i < kFewPairs; ++i) few.push_back(pairs[i * pairs.size() / kFewPairs]);
  return few;
}

}  // namespace

cv::Matx33d ViewMotion::essential() const { return cross_matrix(translation) * rotation; }

ViewMotion find_motion(std::span<const ViewRayPair> pairs, const cv::Matx33d& model,
                       double huber_px) {
  const std::vector<ViewRayPair> few = thinned(pairs);
  const cv::Matx33d rotation = rotation_between(few);
  std::vector<ViewMotion> starts{nearest_motion(model)};
  for (const cv::Vec3d& direction : half_sphere(kStarts)) starts.push_back({rotation, direction});
  ViewMotion best;
  double least = std::numeric_limits<double>::infinity();
  for (ViewMotion& motion : starts) {
    const double cost = descend(few, kFirstSteps, huber_px, motion);
    if (!(cost < least)) continue;
    least = cost;
    best = motion;
  }
  return best;
}

void refine_motion(std::span<const ViewRayPair> pairs, double huber_px, ViewMotion& motion) {
  descend(pairs, kLastSteps, huber_px, motion);
}

}  // namespace loopbit
