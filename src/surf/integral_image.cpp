// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "integral_image.hpp"

#include <algorithm>

namespace loopbit {

void IntegralImage::load(const cv::Mat1b& gray, const Kernels& kernels) {
  size_px_ = gray.size();
  const std::ptrdiff_t half = (gray.cols / 2 + 16) / 16 * 16;  // whole cache lines
  stride_ = 2 * half;
  corners_.resize(static_cast<std::size_t>(stride_ * (gray.rows + 1)));
  std::fill_n(corners_.begin(), stride_, 0);
  column_sums_.assign(static_cast<std::size_t>(gray.cols), 0);
  for (int y = 0; y < gray.rows; ++y) {
    std::uint32_t* corners = corners_.data() + (y + 1) * stride_;
    kernels.integral_row(gray[y], column_sums_.size(), column_sums_.data(), corners,
                         corners + half);
  }
}

}  // namespace loopbit
