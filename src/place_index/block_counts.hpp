// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "loopbit/binary_content.hpp"

#include "bound_kernels.hpp"

namespace loopbit {

/// How many pixels are set in each block of 4 x 4 pixels: 16 rows of 16 blocks, counts 0 to 16. Of
/// each row the blocks of even columns come first, then those of odd ones.
/// For any two contents |O1 & O2| <= sum over blocks of min(counts of O1, counts of O2).
struct BlockCounts {
  static constexpr std::size_t kRows = 16;
  static constexpr std::size_t kColumns = 16;

  alignas(64) std::array<std::uint8_t, kBlockCounts> of{};
};
static_assert(BlockCounts::kRows * BlockCounts::kColumns == kBlockCounts);

/// The same in 4 bits each, as kernels want them: 15 became 16, so that sums still bound.
struct PackedCounts {
  alignas(64) std::array<std::uint8_t, kPackedBytes> of;
};

/// The same in blocks of 8 x 8 pixels: 8 blocks a row, 8 rows, counts 0 to 64.
struct CoarseCounts {
  alignas(64) std::array<std::uint8_t, kCoarseCounts> of{};
};

[[nodiscard]] BlockCounts block_counts(const BinaryContent& content);
[[nodiscard]] PackedCounts packed(const BlockCounts& counts);
[[nodiscard]] CoarseCounts coarse_counts(const BlockCounts& counts);
/// |O| of the content that they are of.
[[nodiscard]] int count(const CoarseCounts& counts);

/// Raises each of `maxima` to what `counts` has there.
template <typename Counts>
void raise(Counts& maxima, const Counts& counts) {
  std::transform(maxima.of.begin(), maxima.of.end(), counts.of.begin(), maxima.of.begin(),
                 [](std::uint8_t a, std::uint8_t b) { return std::max(a, b); });
}

}  // namespace loopbit
