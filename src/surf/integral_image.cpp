// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "integral_image.hpp"

#include <algorithm>

namespace loopbit {
namespace {

/// Corners before the first row and after the last that kernels may read, but make no use of.
constexpr std::ptrdiff_t kMargin = 128;
/// Corners in a cache line.
constexpr std::ptrdiff_t kLine = 16;

}  // namespace

void IntegralImage::load(const cv::Mat1b& gray, const SurfKernels& kernels) {
  size_px_ = gray.size();
  const std::ptrdiff_t half = (gray.cols / 2 + kLine) / kLine * kLine;
  stride_ = 2 * half;
  memory_.resize(static_cast<std::size_t>(stride_ * (gray.rows + 1) + 2 * kMargin + kLine));
  const auto address = reinterpret_cast<std::uintptr_t>(memory_.data());
  corners_ = memory_.data() + kMargin + (-address / 4 % kLine);
  std::fill_n(corners_, stride_, 0);
  column_sums_.assign(static_cast<std::size_t>(gray.cols), 0);
  for (int y = 0; y < gray.rows; ++y) {
    std::uint32_t* corners = corners_ + (y + 1) * stride_;
    kernels.integral_row(gray[y], column_sums_.size(), column_sums_.data(), corners,
                         corners + half);
  }
}

double IntegralImage::sum_before(double x, double y) const {
  x = std::clamp(x, 0.0, static_cast<double>(size_px_.width));
  y = std::clamp(y, 0.0, static_cast<double>(size_px_.height));
  const int left = std::min(static_cast<int>(x), size_px_.width - 1);
  const int top = std::min(static_cast<int>(y), size_px_.height - 1);
  const auto along_row = [&](int row_y) {
    const double before = row(row_y)[column(left)];
    return before + (x - left) * (row(row_y)[column(left + 1)] - before);
  };
  const double above = along_row(top);
  return above + (y - top) * (along_row(top + 1) - above);
}

}  // namespace loopbit
