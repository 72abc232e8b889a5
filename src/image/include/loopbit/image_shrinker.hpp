// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/instruction_set.hpp"

namespace loopbit {

/// Shrinks images by averaging. It keeps its memory from image to image. Sums are integers, so
/// every processor gives the same pixels.
class ImageShrinker {
 public:
  explicit ImageShrinker(InstructionSet instruction_set = active_instruction_set())
      : instruction_set_(instruction_set) {}

  /// Each pixel of `small` is the rounded mean of its part of `gray`, weighted by the area of each
  /// pixel in that part. Parts end at multiples of 1/256 px if there are more than 256 along an
  /// axis; otherwise they are exact. `size` must not exceed the size of `gray` along either axis.
  /// Cost: one pass over `gray`.
  void shrink(const cv::Mat1b& gray, cv::Size size, cv::Mat1b& small);

 private:
  /// Where a column of parts ends.
  struct Column {
    std::size_t last;    ///< pixel in which it ends
    std::int64_t share;  ///< share of that pixel, in units of 1 / pixel_length_
    double length;       ///< width of the parts, in the same units
  };

  void find_columns(int pixels, int parts);
  void average(double height, std::uint8_t* means);

  InstructionSet instruction_set_;
  std::int64_t pixel_length_ = 1;
  std::vector<Column> columns_;
  std::vector<std::uint32_t> sums_;  ///< column sums within a row of parts, then a 0
  std::vector<std::int64_t> up_to_;  ///< prefix sums of `sums_`
};

}  // namespace loopbit
