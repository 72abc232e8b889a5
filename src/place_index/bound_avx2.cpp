// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Nothing here may run before the processor was asked for AVX2.
#include <immintrin.h>

#include "bound_kernels.hpp"
#include "bound_x86.hpp"

namespace loopbit {
namespace {

__m256i load_bytes(const void* address) {
  return _mm256_loadu_si256(static_cast<const __m256i*>(address));
}

/// Two records of block counts. Eight minima of at most 16 fit in 8 bits.
struct Pair {
  struct Lanes {
    __m256i first;
    __m256i second;
  };
  using Parts = __m256i[kBlockCounts / kPackedRun];

  Parts first;
  Parts second;

  Pair(const std::uint8_t* first_record, const std::uint8_t* second_record) {
    unpack(first_record, first);
    unpack(second_record, second);
  }

  static void unpack(const std::uint8_t* record, Parts& parts) {
    const __m256i counts =
        _mm256_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 16,  //
                         0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 16);
    const __m256i low_nibbles = _mm256_set1_epi8(15);
    for (std::size_t byte = 0; byte < kPackedBytes; byte += kPackedRun) {
      const __m256i packed = load_bytes(record + byte);
      const __m256i lower = _mm256_and_si256(packed, low_nibbles);
      const __m256i upper = _mm256_and_si256(_mm256_srli_epi16(packed, 4), low_nibbles);
      __m256i* const part = parts + 2 * byte / kPackedRun;
      part[0] = _mm256_shuffle_epi8(counts, lower);
      part[1] = _mm256_shuffle_epi8(counts, upper);
    }
  }

  static __m256i beside(__m256i sums, const Parts& parts, const std::uint8_t* query) {
    const auto minimum = [&](std::size_t i) {
      return _mm256_min_epu8(parts[i], load_bytes(query + i * kPackedRun));
    };
    const auto minima_of_4 = [&](std::size_t i) {
      return _mm256_add_epi8(_mm256_add_epi8(minimum(i), minimum(i + 1)),
                             _mm256_add_epi8(minimum(i + 2), minimum(i + 3)));
    };
    const __m256i minima = _mm256_add_epi8(minima_of_4(0), minima_of_4(4));
    return _mm256_or_si256(_mm256_slli_epi64(sums, 16),
                           _mm256_sad_epu8(minima, _mm256_setzero_si256()));
  }

  void add_min_sums(const std::uint8_t* query, Lanes& lanes) const {
    lanes = {beside(lanes.first, first, query), beside(lanes.second, second, query)};
  }

  static __m128i reduce(const Lanes& lanes) {
    const auto half = [](__m256i sums) {
      return _mm_add_epi16(_mm256_castsi256_si128(sums), _mm256_extracti128_si256(sums, 1));
    };
    const __m128i first = half(lanes.first);
    const __m128i second = half(lanes.second);
    return _mm_add_epi16(_mm_unpacklo_epi64(first, second), _mm_unpackhi_epi64(first, second));
  }
};

// Coarse counts: 16 records side by side, in two halves. Two minima of at most 64 fit in 8 bits,
// the sum of all of a record in 16.

__m256i four_counts(const std::uint8_t* query, std::size_t first) {
  std::int32_t bytes = 0;
  __builtin_memcpy(&bytes, query + first, sizeof bytes);
  return _mm256_set1_epi32(bytes);
}

/// The sums of the minima of a query with the 16 records of a group.
__m256i coarse_sums_of_group(const std::uint8_t* query, const std::uint8_t* group,
                             const CoarseChunks& chunks) {
  constexpr std::size_t kHalf = kInterleaved / 2 * kCountsAtOnce;
  const __m256i ones = _mm256_set1_epi8(1);
  __m256i low = _mm256_setzero_si256();
  __m256i high = _mm256_setzero_si256();
  for (std::size_t i = 0; i < chunks.size; i += 2) {
    const std::size_t c = chunks.numbers[i] * kCountsAtOnce;
    const std::size_t d = chunks.numbers[i + 1] * kCountsAtOnce;
    const __m256i query_c = four_counts(query, c);
    const __m256i query_d = four_counts(query, d);
    const auto sums_with = [&](const std::uint8_t* half) {
      const __m256i both =
          _mm256_add_epi8(_mm256_min_epu8(load_bytes(half + c * kInterleaved), query_c),
                          _mm256_min_epu8(load_bytes(half + d * kInterleaved), query_d));
      return _mm256_maddubs_epi16(both, ones);
    };
    low = _mm256_add_epi16(low, sums_with(group));
    high = _mm256_add_epi16(high, sums_with(group + kHalf));
  }
  const auto of_eight = [](__m256i sums) { return _mm256_madd_epi16(sums, _mm256_set1_epi16(1)); };
  // Packing takes halves of the registers in turn.
  return _mm256_permute4x64_epi64(_mm256_packus_epi32(of_eight(low), of_eight(high)),
                                  _MM_SHUFFLE(3, 1, 2, 0));
}

void coarse_sums(const std::uint8_t* queries, std::size_t num_queries, const std::uint8_t* groups,
                 std::size_t num_groups, std::uint16_t* sums, std::uint16_t* largest) {
  const CoarseChunks chunks = chunks_of(queries, num_queries);
  for (std::size_t group = 0; group < num_groups; ++group) {
    const std::uint8_t* counts = groups + group * kInterleaved * kCoarseCounts;
    __m256i best = _mm256_setzero_si256();
    for (std::size_t q = 0; q < num_queries; ++q) {
      const __m256i here = coarse_sums_of_group(queries + q * kCoarseCounts, counts, chunks);
      _mm256_storeu_si256(
          reinterpret_cast<__m256i*>(sums + (group * num_queries + q) * kInterleaved), here);
      best = _mm256_max_epu16(best, here);
    }
    largest[group] = largest_of_16(best);
  }
}

std::size_t select_records(const std::uint16_t* sums, const std::uint16_t* largest,
                           std::size_t num_queries, std::size_t num_groups,
                           const Selection& selection, Selected* selected) {
  const __m256i lower = _mm256_set1_epi16(static_cast<std::int16_t>(selection.lower));
  const __m256i upper = _mm256_set1_epi16(static_cast<std::int16_t>(selection.upper));
  std::size_t num_selected = 0;
  for (std::size_t group = 0; group < num_groups; ++group) {
    if (largest[group] < selection.lower) continue;
    const std::size_t first = group * kInterleaved;
    const auto [best, bits] = reaching_group(sums, num_queries, group, selection);
    const __m256i is_outside =
        _mm256_or_si256(_mm256_cmpgt_epi16(lower, best),
                        _mm256_or_si256(_mm256_cmpeq_epi16(_mm256_max_epu16(best, upper), best),
                                        _mm256_cmpeq_epi16(bits, _mm256_setzero_si256())));
    const __m128i bytes = _mm_packs_epi16(_mm256_castsi256_si128(is_outside),
                                          _mm256_extracti128_si256(is_outside, 1));
    alignas(32) std::uint16_t queries[kInterleaved];
    _mm256_store_si256(reinterpret_cast<__m256i*>(queries), bits);
    for (auto left = ~static_cast<std::uint32_t>(_mm_movemask_epi8(bytes)) & 0xFFFFU; left != 0;
         left &= left - 1) {
      const auto i = static_cast<std::size_t>(__builtin_ctz(left));
      selected[num_selected++] = {static_cast<std::uint16_t>(first + i), queries[i]};
    }
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
