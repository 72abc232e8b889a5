// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "block_counts.hpp"

namespace loopbit {
namespace {

/// The number of set bits of each byte, in that byte.
std::uint64_t bits_of_bytes(std::uint64_t word) {
  word -= (word >> 1U) & 0x5555555555555555U;
  word = (word & 0x3333333333333333U) + ((word >> 2U) & 0x3333333333333333U);
  return (word + (word >> 4U)) & 0x0F0F0F0F0F0F0F0FU;
}

}  // namespace

BlockCounts block_counts(const BinaryContent& content) {
  constexpr std::size_t kHeight = kContentSide / BlockCounts::kRows;
  BlockCounts counts;
  for (std::size_t y = 0; y < BlockCounts::kRows; ++y) {
    std::uint64_t sums = 0;
    for (std::size_t row = y * kHeight; row < (y + 1) * kHeight; ++row) {
      sums += bits_of_bytes(content.rows[row]);
    }
    for (std::size_t x = 0; x < BlockCounts::kColumns; ++x) {
      counts.of[y * BlockCounts::kColumns + x] = static_cast<std::uint8_t>(sums >> (8 * x));
    }
  }
  return counts;
}

CoarseCounts coarse_counts(const BlockCounts& counts) {
  constexpr std::size_t kColumns = BlockCounts::kColumns;
  CoarseCounts coarse;
  for (std::size_t i = 0; i < kCoarseCounts; ++i) {
    const std::size_t upper = i / kColumns * 2 * kColumns + i % kColumns;
    coarse.of[i] = static_cast<std::uint8_t>(counts.of[upper] + counts.of[upper + kColumns]);
  }
  return coarse;
}

}  // namespace loopbit
