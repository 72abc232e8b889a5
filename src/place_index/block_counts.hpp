// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "loopbit/binary_content.hpp"

namespace loopbit {

/// How many pixels are set in each block of 8 x 4 pixels: 8 blocks a row, 16 rows, counts 0 to 32.
/// For any two contents |O1 & O2| <= sum over blocks of min(counts of O1, counts of O2).
struct BlockCounts {
  static constexpr std::size_t kRows = 16;
  static constexpr std::size_t kColumns = 8;

  alignas(64) std::array<std::uint8_t, kRows * kColumns> of{};
};

[[nodiscard]] BlockCounts block_counts(const BinaryContent& content);

/// Raises each of `maxima` to what `counts` has there.
void raise(BlockCounts& maxima, const BlockCounts& counts);

}  // namespace loopbit
