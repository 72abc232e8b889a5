// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/kernels_for.hpp"

#include "epipolar_kernels.hpp"
#include "essential_fit.hpp"

namespace loopbit {

/// The epipolar geometry that explains most of a set of matches: RANSAC over minimal samples of
/// seven (Hartley and Zisserman 2004, section 11.1.2), scored by truncated squared errors (MSAC),
/// each best model so far refitted to its inliers (LO-RANSAC, Chum et al. 2003). Each call draws
/// the same samples, so the same points give the same inliers. Its memory is kept from call to
/// call.
class EpipolarRansac {
 public:
  /// Pairs of points in pixels of the two images.
  struct Pair {
    float x0 = 0;
    float y0 = 0;
    float x1 = 0;
    float y1 = 0;
  };

  explicit EpipolarRansac(InstructionSet instruction_set)
      : kernels_(kernels_for<EpipolarKernels>(instruction_set)) {}

  /// is_inlier()[i] tells whether pairs[i] lies within `max_error_px` of the geometry, by Sampson's
  /// distance; returns how many do. 0 below 8 pairs, or where no sample determines a geometry.
  int find(std::span<const Pair> pairs, double max_error_px);

  /// The same for rays of any lens and an essential matrix; `max_error_px` is an angle, of so many
  /// pixels at each of them.
  int find(std::span<const ViewRayPair> pairs, double max_error_px);

  [[nodiscard]] std::span<const std::uint8_t> is_inlier() const {
    return std::span(is_inlier_).first(pairs_.count);
  }

 private:
  std::array<float*, 8> make_room(std::size_t count);
  void normalize(std::span<const Pair> pairs, double max_error_px);
  void normalize(std::span<const ViewRayPair> pairs, double max_error_px);
  int search();
  [[nodiscard]] EpipolarScore score(const cv::Matx33d& model);
  void offer(const cv::Matx33d& model);
  [[nodiscard]] double fit_weight(std::size_t pair) const;
  [[nodiscard]] cv::Matx<double, 9, 9> sum_of_squares() const;
  [[nodiscard]] cv::Matx33d fit() const;
  void refit();
  void make_essential(std::span<const ViewRayPair> pairs, double max_error_px);

  const EpipolarKernels& kernels_;
  std::vector<float> coordinates_;  ///< of points: about their mean, in units of their spread
  PointPairs pairs_;                ///< in coordinates_
  std::vector<ViewRayPair> ray_inliers_;
  RaySpreads spreads_;  ///< in coordinates_, or null for points
  float max_error_sq_ = 0;
  cv::Matx33d best_;
  EpipolarScore best_score_;
  std::vector<std::uint8_t> is_inlier_;  ///< of the model that was scored last
};

}  // namespace loopbit
