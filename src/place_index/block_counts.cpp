// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "block_counts.hpp"

#include <bit>
#include <cstring>
#include <numeric>

namespace loopbit {
namespace {

static_assert(std::endian::native == std::endian::little, "byte x of a row's word is block x");

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
    std::memcpy(&counts.of[y * BlockCounts::kColumns], &sums, sizeof sums);
  }
  return counts;
}

int count(const BlockCounts& counts) {
  return std::accumulate(counts.of.begin(), counts.of.end(), 0);
}

CoarseCounts coarse_counts(const BlockCounts& counts) {
  constexpr std::size_t kColumns = BlockCounts::kColumns;
  CoarseCounts coarse;
  for (std::size_t row = 0; row < kCoarseCounts; row += kColumns) {
    const std::uint8_t* upper = &counts.of[2 * row];
    for (std::size_t x = 0; x < kColumns; ++x) {
      coarse.of[row + x] = static_cast<std::uint8_t>(upper[x] + upper[x + kColumns]);
    }
  }
  return coarse;
}

}  // namespace loopbit
