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

void IntegralImage::load(const cv::Mat1b& gray, const Kernels& kernels) {
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

}  // namespace loopbit
