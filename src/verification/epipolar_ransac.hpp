// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

namespace loopbit {

/// The fundamental matrix that explains most of a set of matches: RANSAC over minimal samples of
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

  /// is_inlier()[i] tells whether pairs[i] lies within `max_error_px` of the geometry, by Sampson's
  /// distance; returns how many do. 0 below 8 pairs, or where no sample determines a geometry.
  int find(std::span<const Pair> pairs, double max_error_px);

  [[nodiscard]] std::span<const std::uint8_t> is_inlier() const { return is_inlier_; }

 private:
  struct Score {
    float cost = 0;
    int inliers = 0;
  };

  void normalize(std::span<const Pair> pairs, double max_error_px);
  [[nodiscard]] Score score(const cv::Matx33d& model) const;
  void offer(const cv::Matx33d& model);
  [[nodiscard]] cv::Matx33d fit() const;
  void refit();
  void mark(const cv::Matx33d& model);

  std::vector<Pair> pairs_;  ///< about their mean, in units of their spread
  float max_error_sq_ = 0;
  cv::Matx33d best_;
  Score best_score_;
  std::vector<std::uint8_t> is_inlier_;
};

}  // namespace loopbit
