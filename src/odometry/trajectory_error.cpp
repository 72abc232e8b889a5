// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/trajectory_error.hpp"

#include <cmath>
#include <cstddef>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

cv::Vec3d mean_of(std::span<const cv::Vec3d> points) {
  cv::Vec3d sum;
  for (const cv::Vec3d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

}  // namespace

double absolute_trajectory_error_m(std::span<const cv::Vec3d> positions_m,
                                   std::span<const cv::Vec3d> truth_m) {
  if (positions_m.size() != truth_m.size()) {
    throw Error(ErrorKind::option,
                fmt::format("There are {} positions, but {} true ones: give one for each.",
                            positions_m.size(), truth_m.size()));
  }
  constexpr std::size_t kLeast = 3;
  if (truth_m.size() < kLeast) return 0;
  const cv::Vec3d middle = mean_of(positions_m);
  const cv::Vec3d true_middle = mean_of(truth_m);
  cv::Matx33d products = cv::Matx33d::zeros();
  for (std::size_t i = 0; i < truth_m.size(); ++i) {
    products += (truth_m[i] - true_middle) * (positions_m[i] - middle).t();
  }
  cv::Matx31d w;
  cv::Matx33d u;
  cv::Matx33d vt;
  cv::SVD::compute(products, w, u, vt);
  const double sign = cv::determinant(u) * cv::determinant(vt) < 0 ? -1 : 1;
  const cv::Matx33d rotation = u * cv::Matx33d::diag({1, 1, sign}) * vt;
  double sum_sq = 0;
  for (std::size_t i = 0; i < truth_m.size(); ++i) {
    const cv::Vec3d error = truth_m[i] - true_middle - rotation * (positions_m[i] - middle);
    sum_sq += error.dot(error);
  }
  return std::sqrt(sum_sq / static_cast<double>(truth_m.size()));
}

}  // namespace loopbit
