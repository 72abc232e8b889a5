// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/image_shrinker.hpp"

#include <algorithm>
#include <cstddef>

#include "loopbit/kernels_for.hpp"

#include "shrink_kernels.hpp"

namespace loopbit {
namespace {

/// An axis of pixels, cut into equal parts.
class Axis {
 public:
  Axis(int pixels, int parts)
      : pixels_(pixels), parts_(parts), pixel_length_(std::min(parts, kMaxPixelLength)) {}

  /// In what unit lengths are: so many are a pixel.
  [[nodiscard]] std::int64_t pixel_length() const { return pixel_length_; }

  /// The length up to where a part begins, and the one before ends.
  [[nodiscard]] std::int64_t edge(int part) const {
    return (2 * pixel_length_ * part * pixels_ + parts_) / (2 * parts_);
  }

 private:
  static constexpr int kMaxPixelLength = 256;  // a weight that ShrinkKernels::add_pixels takes

  std::int64_t pixels_;
  std::int64_t parts_;
  std::int64_t pixel_length_;
};

}  // namespace

void ImageShrinker::shrink(const cv::Mat1b& gray, cv::Size size, cv::Mat1b& small) {
  const auto& kernels = kernels_for<ShrinkKernels>(instruction_set_);
  small.create(size);
  sums_.resize(static_cast<std::size_t>(gray.cols) + 1);
  up_to_.resize(sums_.size());
  find_columns(gray.cols, size.width);
  const Axis down(gray.rows, size.height);
  for (int y = 0; y < size.height; ++y) {
    const std::int64_t top = down.edge(y);
    const std::int64_t bottom = down.edge(y + 1);
    std::fill(sums_.begin(), sums_.end(), 0U);
    for (std::int64_t row = top / down.pixel_length(); row * down.pixel_length() < bottom; ++row) {
      const std::int64_t share = std::min(bottom, (row + 1) * down.pixel_length()) -
                                 std::max(top, row * down.pixel_length());
      kernels.add_pixels(gray[static_cast<int>(row)], sums_.size() - 1,
                         static_cast<std::uint16_t>(share), sums_.data());
    }
    average(static_cast<double>(bottom - top), small[y]);
  }
}

void ImageShrinker::find_columns(int pixels, int parts) {
  const Axis across(pixels, parts);
  pixel_length_ = across.pixel_length();
  columns_.resize(static_cast<std::size_t>(parts));
  for (int i = 0; i < parts; ++i) {
    const std::int64_t end = across.edge(i + 1);
    columns_[static_cast<std::size_t>(i)] = {.last = static_cast<std::size_t>(end / pixel_length_),
                                             .share = end % pixel_length_,
                                             .length = static_cast<double>(end - across.edge(i))};
  }
}

void ImageShrinker::average(double height, std::uint8_t* means) {
  for (std::size_t x = 1; x < sums_.size(); ++x) up_to_[x] = up_to_[x - 1] + sums_[x - 1];
  std::int64_t sum_before = 0;
  for (const Column& column : columns_) {
    const std::int64_t sum =
        pixel_length_ * up_to_[column.last] + column.share * sums_[column.last];
    const double area = height * column.length;
    // Half an area more, so that cutting off rounds.
    *means++ = static_cast<std::uint8_t>((static_cast<double>(sum - sum_before) + area / 2) / area);
    sum_before = sum;
  }
}

}  // namespace loopbit
