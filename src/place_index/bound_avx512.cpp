// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Nothing here may run before the processor was asked for AVX-512.
#include <immintrin.h>

#include "bound_kernels.hpp"
#include "bound_x86.hpp"

namespace loopbit {
namespace {

/// Two records of block counts, side by side. Eight minima of at most 16 fit in 8 bits.
struct Pair {
  using Lanes = __m512i;
  static constexpr std::size_t kParts = kBlockCounts / kPackedRun;

  __m512i parts[kParts];

  Pair(const std::uint8_t* first, const std::uint8_t* second) {
    const __m512i counts =
        _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 16));
    const __m512i low_nibbles = _mm512_set1_epi8(15);
    for (std::size_t i = 0; i < kParts; i += 2) {
      const auto half = [&](const std::uint8_t* record) {
        return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(record + i / 2 * kPackedRun));
      };
      const __m512i both = _mm512_inserti64x4(_mm512_castsi256_si512(half(first)), half(second), 1);
      const __m512i lower = _mm512_and_si512(both, low_nibbles);
      const __m512i upper = _mm512_and_si512(_mm512_srli_epi16(both, 4), low_nibbles);
      parts[i] = _mm512_shuffle_epi8(counts, lower);
      parts[i + 1] = _mm512_shuffle_epi8(counts, upper);
    }
  }

  void add_min_sums(const std::uint8_t* query, Lanes& lanes) const {
    const auto minimum = [&](std::size_t i) {
      const auto* counts = reinterpret_cast<const __m256i*>(query + i * kPackedRun);
      return _mm512_min_epu8(parts[i], _mm512_broadcast_i64x4(_mm256_loadu_si256(counts)));
    };
    const auto minima_of_4 = [&](std::size_t i) {
      return _mm512_add_epi8(_mm512_add_epi8(minimum(i), minimum(i + 1)),
                             _mm512_add_epi8(minimum(i + 2), minimum(i + 3)));
    };
    const __m512i minima = _mm512_add_epi8(minima_of_4(0), minima_of_4(4));
    lanes = _mm512_or_si512(_mm512_slli_epi64(lanes, 16),
                            _mm512_sad_epu8(minima, _mm512_setzero_si512()));
  }

  static __m128i reduce(Lanes lanes) {
    const __m512i swapped = _mm512_shuffle_i64x2(lanes, lanes, _MM_SHUFFLE(2, 3, 0, 1));
    const __m512i sums = _mm512_add_epi16(lanes, swapped);
    const __m128i first = _mm512_castsi512_si128(sums);
    const __m128i second = _mm512_extracti64x2_epi64(sums, 2);
    return _mm_add_epi16(_mm_unpacklo_epi64(first, second), _mm_unpackhi_epi64(first, second));
  }
};

// Coarse counts: 16 records side by side. Two minima of at most 64 fit in 8 bits.

__m512i four_counts(const std::uint8_t* query, std::size_t chunk) {
  std::int32_t bytes = 0;
  __builtin_memcpy(&bytes, query + kCountsAtOnce * chunk, sizeof bytes);
  return _mm512_set1_epi32(bytes);
}

/// The sums of the minima of Count queries with the 16 records of a group; raises `best` to them.
template <std::size_t Count>
__m256i coarse_sums_of_group(const std::uint8_t* queries, const std::uint8_t* group,
                             const CoarseChunks& chunks, std::uint16_t* sums, __m256i best) {
  constexpr std::size_t kStride = kInterleaved * kCountsAtOnce;
  constexpr std::size_t kAhead = 8 * kInterleaved * kCoarseCounts;  // so far memory is asked for
  __m512i all[Count];
  for (std::size_t q = 0; q < Count; ++q) all[q] = _mm512_setzero_si512();
  for (std::size_t i = 0; i < chunks.size; i += 2) {
    const std::size_t c = chunks.numbers[i];
    const std::size_t d = chunks.numbers[i + 1];
    __builtin_prefetch(group + kAhead + c * kStride);
    __builtin_prefetch(group + kAhead + d * kStride);
    const __m512i low = _mm512_loadu_si512(group + c * kStride);
    const __m512i high = _mm512_loadu_si512(group + d * kStride);
    for (std::size_t q = 0; q < Count; ++q) {
      const std::uint8_t* query = queries + q * kCoarseCounts;
      const __m512i both = _mm512_add_epi8(_mm512_min_epu8(low, four_counts(query, c)),
                                           _mm512_min_epu8(high, four_counts(query, d)));
      all[q] = _mm512_dpbusd_epi32(all[q], both, _mm512_set1_epi8(1));
    }
  }
  for (std::size_t q = 0; q < Count; ++q) {
    const __m256i packed = _mm512_cvtepi32_epi16(all[q]);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(sums + q * kInterleaved), packed);
    best = _mm256_max_epu16(best, packed);
  }
  return best;
}

void coarse_sums(const std::uint8_t* queries, std::size_t num_queries, const std::uint8_t* groups,
                 std::size_t num_groups, std::uint16_t* sums, std::uint16_t* largest) {
  constexpr std::size_t kQueriesAtOnce = 5;  // as many shifts as are tolerated by default
  const CoarseChunks chunks = chunks_of(queries, num_queries);
  for (std::size_t group = 0; group < num_groups; ++group) {
    const std::uint8_t* counts = groups + group * kInterleaved * kCoarseCounts;
    std::uint16_t* here = sums + group * num_queries * kInterleaved;
    __m256i best = _mm256_setzero_si256();
    std::size_t q = 0;
    for (; q + kQueriesAtOnce <= num_queries; q += kQueriesAtOnce) {
      best = coarse_sums_of_group<kQueriesAtOnce>(queries + q * kCoarseCounts, counts, chunks,
                                                  here + q * kInterleaved, best);
    }
    for (; q < num_queries; ++q) {
      best = coarse_sums_of_group<1>(queries + q * kCoarseCounts, counts, chunks,
                                     here + q * kInterleaved, best);
    }
    largest[group] = largest_of_16(best);
  }
}

std::size_t select_records(const std::uint16_t* sums, const std::uint16_t* largest,
                           std::size_t num_queries, std::size_t num_groups,
                           const Selection& selection, Selected* selected) {
  const __m512i order = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const __m256i lower = _mm256_set1_epi16(static_cast<std::int16_t>(selection.lower));
  const __m256i upper = _mm256_set1_epi16(static_cast<std::int16_t>(selection.upper));
  std::size_t num_selected = 0;
  for (std::size_t group = 0; group < num_groups; ++group) {
    if (largest[group] < selection.lower) continue;
    const std::size_t first = group * kInterleaved;
    const auto [best, bits] = reaching_group(sums, num_queries, group, selection);
    const __mmask16 is_within =
        _mm256_mask_cmplt_epu16_mask(_mm256_cmpge_epu16_mask(best, lower), best, upper);
    const __mmask16 is_selected = _mm256_mask_test_epi16_mask(is_within, bits, bits);
    const __m512i numbers = _mm512_add_epi32(order, _mm512_set1_epi32(static_cast<int>(first)));
    const __m512i both =
        _mm512_or_si512(numbers, _mm512_slli_epi32(_mm512_cvtepu16_epi32(bits), 16));
    // As Selected lies in memory. What is behind the last one is overwritten: there is room for it.
    _mm512_storeu_si512(selected + num_selected, _mm512_maskz_compress_epi32(is_selected, both));
    num_selected += static_cast<std::size_t>(__builtin_popcount(is_selected));
  }
  return num_selected;
}

constexpr BoundKernels kBoundKernels{reaching_queries<Pair>, coarse_sums, select_records};

}  // namespace

template <InstructionSet>
const BoundKernels& BoundKernels::compiled_for() {
  return kBoundKernels;
}
template const BoundKernels& BoundKernels::compiled_for<InstructionSet::LOOPBIT_INSTRUCTION_SET>();

}  // namespace loopbit
