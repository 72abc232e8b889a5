// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Nothing here may run before the processor was asked for AVX2.
#include <immintrin.h>

#include "overlap_kernels.hpp"

namespace loopbit {
namespace {

__m256i load(const void* address) {
  return _mm256_loadu_si256(static_cast<const __m256i*>(address));
}

/// The number of set bits in each 64-bit lane, by a table of 16 (Mula, Kurz, Lemire,
/// "Faster Population Counts Using AVX2 Instructions", 2018).
__m256i popcount_lanes(__m256i bits) {
  const __m256i table = _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4, 0, 1, 1, 2,
                                         1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
  const __m256i low_nibbles = _mm256_set1_epi8(0x0F);
  const __m256i low = _mm256_and_si256(bits, low_nibbles);
  const __m256i high = _mm256_and_si256(_mm256_srli_epi16(bits, 4), low_nibbles);
  const __m256i counts =
      _mm256_add_epi8(_mm256_shuffle_epi8(table, low), _mm256_shuffle_epi8(table, high));
  return _mm256_sad_epu8(counts, _mm256_setzero_si256());
}

int sum_lanes_epi64(__m256i lanes) {
  const __m128i pair =
      _mm_add_epi64(_mm256_castsi256_si128(lanes), _mm256_extracti128_si256(lanes, 1));
  return static_cast<int>(_mm_cvtsi128_si64(pair) + _mm_extract_epi64(pair, 1));
}

int overlap(const std::uint64_t* a, const std::uint64_t* b) {
  __m256i sums = _mm256_setzero_si256();
  for (std::size_t word = 0; word < kContentWords; word += 4) {
    const __m256i both = _mm256_and_si256(load(a + word), load(b + word));
    sums = _mm256_add_epi64(sums, popcount_lanes(both));
  }
  return sum_lanes_epi64(sums);
}

constexpr OverlapKernels kOverlapKernels{max_overlaps_by<overlap>};

}  // namespace

template <InstructionSet>
const OverlapKernels& OverlapKernels::compiled_for() {
  return kOverlapKernels;
}
template const OverlapKernels&
OverlapKernels::compiled_for<InstructionSet::LOOPBIT_INSTRUCTION_SET>();

}  // namespace loopbit
