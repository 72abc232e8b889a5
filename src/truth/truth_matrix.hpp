// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "loopbit/ground_truth.hpp"

namespace loopbit::truth {

/// The true entries of a square matrix of ground truth; see read_truth for what they mean. Memory:
/// a bit for each pair of a query that has a place.
class TruthMatrix {
 public:
  struct Shape {
    std::size_t rows;
    std::size_t columns;
  };

  /// The most rows read.
  static constexpr std::size_t kMaxRows = 100'000;

  /// Without true entries, `views` rows a frame. Throws Error (kind input) that begins with
  /// `thing` if `shape` is not square, is too large or cannot be divided into frames.
  TruthMatrix(const std::string& thing, Shape shape, int views);

  /// Both less than the number of rows; in any order, as often as one likes.
  void add(std::size_t row, std::size_t column);

  [[nodiscard]] std::size_t frames() const { return places_.size(); }

  /// By query, then by place.
  [[nodiscard]] std::vector<PlaceRun> runs() const;

 private:
  std::size_t views_;
  std::vector<std::vector<std::uint64_t>> places_;  ///< bits by query; empty where none is set
};

}  // namespace loopbit::truth
