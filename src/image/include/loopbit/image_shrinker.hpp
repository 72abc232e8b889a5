// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/instruction_set.hpp"

namespace loopbit {

/// Averages images down, with memory that is kept from image to image. Sums are whole numbers:
/// every processor gives the same pixels.
class ImageShrinker {
 public:
  explicit ImageShrinker(InstructionSet instruction_set = active_instruction_set())
      : instruction_set_(instruction_set) {}

  /// Each pixel of `small` is the mean of its part of `gray`, by the share of every pixel in it,
  /// rounded; parts end at multiples of 1/256 px where there are more than 256 along an axis, and
  /// are exact otherwise. `size` is at most gray's along either axis.
  /// Cost: one pass over `gray`.
  void shrink(const cv::Mat1b& gray, cv::Size size, cv::Mat1b& small);

 private:
  /// Of the parts above each other: where they end.
  struct Column {
    std::size_t last;    ///< the pixel in which
    std::int64_t share;  ///< of that pixel, in units of 1 / pixel_length_
    double length;       ///< of the parts, in the same
  };

  void find_columns(int pixels, int parts);
  void average(double height, std::uint8_t* means);

  InstructionSet instruction_set_;
  std::int64_t pixel_length_ = 1;
  std::vector<Column> columns_;
  std::vector<std::uint32_t> sums_;  ///< of the pixels above each other in a row of parts, and a 0
  std::vector<std::int64_t> up_to_;  ///< of the sums before each
};

}  // namespace loopbit
