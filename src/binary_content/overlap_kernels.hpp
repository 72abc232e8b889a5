// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "loopbit/instruction_set.hpp"

namespace loopbit {

/// 64-bit words in one binary content.
inline constexpr std::size_t kContentWords = 64;

/// The inner loop of max_overlaps(), for one instruction set.
struct OverlapKernels {
  template <InstructionSet>
  static const OverlapKernels& compiled_for();

  /// overlaps[i] = max over q of |queries[q] & places[i]|, each content 64 words.
  void (*max_overlaps)(const std::uint64_t* queries, std::size_t num_queries,
                       const std::uint64_t* places, std::size_t num_places,
                       std::uint16_t* overlaps);
};

/// OverlapKernels::max_overlaps by an `overlap` of internal linkage, so that this has it, too.
template <int (*overlap)(const std::uint64_t*, const std::uint64_t*)>
void max_overlaps_by(const std::uint64_t* queries, std::size_t num_queries,
                     const std::uint64_t* places, std::size_t num_places, std::uint16_t* overlaps) {
  for (std::size_t i = 0; i < num_places; ++i) {
    int best = 0;
    for (std::size_t q = 0; q < num_queries; ++q) {
      const int both = overlap(queries + q * kContentWords, places + i * kContentWords);
      best = both > best ? both : best;
    }
    overlaps[i] = static_cast<std::uint16_t>(best);
  }
}

}  // namespace loopbit
