// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/ray_geometry.hpp"

#include <cmath>
#include <cstddef>

namespace loopbit {

cv::Matx33d cross_matrix(const cv::Vec3d& v) {
  return {0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0};
}

cv::Matx33d rotation_by(const cv::Vec3d& r) {
  const double angle_sq = r.dot(r);
  const cv::Matx33d k = cross_matrix(r);
  if (angle_sq < 1e-16) return cv::Matx33d::eye() + k;
  const double angle = std::sqrt(angle_sq);
  return cv::Matx33d::eye() + k * (std::sin(angle) / angle) +
         k * k * ((1 - std::cos(angle)) / angle_sq);
}

cv::Matx33d best_rotation(const cv::Matx33d& sum) {
  cv::Matx31d values;
  cv::Matx33d u;
  cv::Matx33d v_t;
  cv::SVD::compute(sum, values, u, v_t);
  const cv::Matx33d mirror(1, 0, 0, 0, 1, 0, 0, 0, cv::determinant(u * v_t));
  return u * mirror * v_t;
}

std::vector<cv::Vec3d> half_sphere(int count) {
  constexpr double kGoldenAngle = 2.399963229728653;
  std::vector<cv::Vec3d> directions;
  directions.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double z = (i + 0.5) / count;
    const double radius = std::sqrt(1 - z * z);
    directions.emplace_back(radius * std::cos(i * kGoldenAngle),
                            radius * std::sin(i * kGoldenAngle), z);
  }
  return directions;
}

}  // namespace loopbit
