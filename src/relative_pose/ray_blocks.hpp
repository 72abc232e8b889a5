// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "direction_kernels.hpp"
#include "ray_pairs.hpp"

namespace loopbit {

/// Pairs of rays as the inner loops read them. Of their depths they know nothing.
class RayBlocks {
 public:
  explicit RayBlocks(std::span<const RayPair> pairs);
  /// Some of the pairs of `from`.
  RayBlocks(const RayBlocks& from, std::span<const std::size_t> chosen);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] RayArrays arrays() const {
    return {.numbers = numbers_.data(), .stride = stride_, .count = size_};
  }

 private:
  explicit RayBlocks(std::size_t size);

  std::size_t size_ = 0;
  std::size_t stride_ = 0;
  std::vector<float> numbers_;
};

}  // namespace loopbit
