// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "block_counts.hpp"

#include <bit>
#include <cstring>
#include <numeric>

namespace loopbit {
namespace {

static_assert(std::endian::native == std::endian::little, "byte x of a row's word is column x");

constexpr std::uint64_t kLowNibbles = 0x0F0F0F0F0F0F0F0FU;

/// The number of set bits of each four, in these four.
std::uint64_t bits_of_nibbles(std::uint64_t word) {
  word -= (word >> 1U) & 0x5555555555555555U;
  return (word & 0x3333333333333333U) + ((word >> 2U) & 0x3333333333333333U);
}

}  // namespace

BlockCounts block_counts(const BinaryContent& content) {
  static_assert(kContentSide / BlockCounts::kRows == 4);
  BlockCounts counts;
  for (std::size_t y = 0; y < BlockCounts::kRows; ++y) {
    const std::uint64_t* rows = &content.rows[4 * y];
    // Of two rows each: at most 8 in four bits.
    const std::uint64_t upper = bits_of_nibbles(rows[0]) + bits_of_nibbles(rows[1]);
    const std::uint64_t lower = bits_of_nibbles(rows[2]) + bits_of_nibbles(rows[3]);
    const std::array<std::uint64_t, 2> columns{
        (upper & kLowNibbles) + (lower & kLowNibbles),  // the even ones, then the odd ones
        (upper >> 4U & kLowNibbles) + (lower >> 4U & kLowNibbles)};
    std::memcpy(&counts.of[y * BlockCounts::kColumns], columns.data(), sizeof columns);
  }
  return counts;
}

PackedCounts packed(const BlockCounts& counts) {
  PackedCounts result;  // NOLINT: written to before it is read
  for (std::size_t first = 0; first < kPackedBytes; first += kPackedRun) {
    const std::uint8_t* lower = &counts.of[2 * first];
    const std::uint8_t* upper = lower + kPackedRun;
    for (std::size_t k = 0; k < kPackedRun; ++k) {
      const unsigned upper_code = std::min<unsigned>(upper[k], 15);
      const unsigned lower_code = std::min<unsigned>(lower[k], 15);
      result.of[first + k] = static_cast<std::uint8_t>(upper_code << 4U | lower_code);
    }
  }
  return result;
}

CoarseCounts coarse_counts(const BlockCounts& counts) {
  constexpr std::size_t kColumns = BlockCounts::kColumns / 2;
  CoarseCounts coarse;
  for (std::size_t block = 0; block < kCoarseCounts; block += kColumns) {
    // Eight blocks at once, each in a byte: even and odd columns of two rows.
    std::array<std::uint64_t, 4> parts;  // NOLINT: written to before it is read
    std::memcpy(parts.data(), &counts.of[4 * block], sizeof parts);
    const std::uint64_t sums = parts[0] + parts[1] + parts[2] + parts[3];
    std::memcpy(&coarse.of[block], &sums, sizeof sums);
  }
  return coarse;
}

int count(const CoarseCounts& counts) {
  return std::accumulate(counts.of.begin(), counts.of.end(), 0);
}

}  // namespace loopbit
