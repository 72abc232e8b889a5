// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "surf_kernels.hpp"

namespace loopbit {

/// Sums of all pixels above and left of each pixel corner, modulo 2^32: the sum over a box is right
/// as long as it is less than 2^32, that is up to 4096 x 4096 pixels. Its memory is kept from image
/// to image.
class IntegralImage {
 public:
  void load(const cv::Mat1b& gray, const SurfKernels& kernels);

  [[nodiscard]] cv::Size size_px() const { return size_px_; }
  [[nodiscard]] IntegralView view() const {
    return {corners_, stride_, stride_ / 2, size_px_.width, size_px_.height};
  }

  /// 0 <= y <= height: the corners above pixel row y.
  [[nodiscard]] const std::uint32_t* row(int y) const { return corners_ + y * stride_; }
  /// 0 <= x <= width: where a row has the corner left of pixel x.
  [[nodiscard]] std::ptrdiff_t column(int x) const { return x / 2 + (x & 1) * (stride_ / 2); }
  /// The sum over the pixels x0 <= x < x1, y0 <= y < y1.
  [[nodiscard]] std::int32_t box(int x0, int y0, int x1, int y1) const {
    return static_cast<std::int32_t>(row(y1)[column(x1)] - row(y1)[column(x0)] -
                                     row(y0)[column(x1)] + row(y0)[column(x0)]);
  }
  /// The sum over all that lies above and left of a point, to parts of pixels; pixel (0, 0) is the
  /// square from (0, 0) to (1, 1). A point outside counts as the nearest of the image.
  [[nodiscard]] double sum_before(double x, double y) const;

 private:
  cv::Size size_px_;
  std::ptrdiff_t stride_ = 0;
  std::vector<std::uint32_t> memory_;
  std::uint32_t* corners_ = nullptr;
  std::vector<std::uint32_t> column_sums_;
};

}  // namespace loopbit
