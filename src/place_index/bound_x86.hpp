// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <immintrin.h>

#include "bound_kernels.hpp"

namespace loopbit {

/// The largest of 16 unsigned 16-bit values. Static, as each instruction set needs its own.
static std::uint16_t largest_of_16(__m256i values) {
  const __m128i best =
      _mm_max_epu16(_mm256_castsi256_si128(values), _mm256_extracti128_si256(values, 1));
  // VPHMINPOSUW finds the smallest of eight.
  const __m128i smallest = _mm_minpos_epu16(_mm_xor_si128(best, _mm_set1_epi16(-1)));
  return static_cast<std::uint16_t>(~static_cast<unsigned>(_mm_cvtsi128_si32(smallest)));
}

/// The chunks of four coarse counts in which any query has one, and perhaps one more so that their
/// number is even: the others add nothing to a sum.
struct CoarseChunks {
  std::size_t size;
  std::size_t numbers[kCoarseCounts / kCountsAtOnce];
};

static CoarseChunks chunks_of(const std::uint8_t* queries, std::size_t num_queries) {
  constexpr std::size_t kAll = kCoarseCounts / kCountsAtOnce;
  CoarseChunks chunks{};
  std::size_t first_empty = kAll;
  for (std::size_t c = 0; c < kAll; ++c) {
    std::uint32_t any = 0;
    for (std::size_t q = 0; q < num_queries; ++q) {
      std::uint32_t counts = 0;
      __builtin_memcpy(&counts, queries + q * kCoarseCounts + c * kCountsAtOnce, sizeof counts);
      any |= counts;
    }
    chunks.numbers[any != 0 ? chunks.size++ : --first_empty] = c;
  }
  chunks.size += chunks.size % 2;
  return chunks;
}

/// Of each of 16 records the largest sum of all queries, and the bits of those that reach it.
struct ReachingGroup {
  __m256i largest_sums;
  __m256i queries;
};

/// `group`: its number among those that `sums` and `selection` are of.
static ReachingGroup reaching_group(const std::uint16_t* sums, std::size_t num_queries,
                                    std::size_t group, const Selection& selection) {
  const auto of_16 = [](unsigned value) {
    return _mm256_set1_epi16(static_cast<std::int16_t>(value));
  };
  const auto load_16 = [](const std::uint16_t* values) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(values));
  };
  const std::size_t first = group * kInterleaved;
  const __m256i larger =
      _mm256_max_epu16(load_16(selection.smallest_counts + first), of_16(selection.query_count));
  const __m256i need = _mm256_mulhi_epu16(larger, of_16(selection.floor));
  ReachingGroup found{_mm256_setzero_si256(), _mm256_setzero_si256()};
  for (std::size_t q = 0; q < num_queries; ++q) {
    const __m256i here = load_16(sums + first * num_queries + q * kInterleaved);
    const __m256i reaches = _mm256_cmpeq_epi16(_mm256_max_epu16(here, need), here);
    found.largest_sums = _mm256_max_epu16(found.largest_sums, here);
    found.queries = _mm256_or_si256(found.queries, _mm256_and_si256(reaches, of_16(1U << q)));
  }
  return found;
}

/// BoundKernels::reaching_queries by one instruction set's Pair, a type of internal linkage for the
/// reason that kernels_for.hpp gives: it holds two records, sums the minima in 64-bit lanes, of
/// which four queries share the 16-bit quarters, and reduces them to the four sums with the first
/// record and the four with the second.
template <typename Pair>
void reaching_queries(const std::uint8_t* queries, const std::uint16_t* among,
                      const std::uint8_t* const* records, std::size_t num_records,
                      const std::uint16_t* least, Reached* reached) {
  constexpr int kQueriesAtOnce = 4;
  for (std::size_t i = 0; i < num_records; i += 2) {
    const std::size_t second = i + 1 < num_records ? i + 1 : i;
    const Pair pair(records[i], records[second]);
    const __m128i need =
        _mm_unpacklo_epi64(_mm_set1_epi16(static_cast<std::int16_t>(least[i])),
                           _mm_set1_epi16(static_cast<std::int16_t>(least[second])));
    __m128i best = _mm_setzero_si128();
    __m128i found = _mm_setzero_si128();
    for (std::uint32_t left = among[i / 2]; left != 0;) {
      typename Pair::Lanes lanes{};
      std::uint64_t bits = 0;
      for (int n = 0; n < kQueriesAtOnce && left != 0; ++n, left &= left - 1) {
        const auto q = static_cast<std::size_t>(__builtin_ctz(left));
        pair.add_min_sums(queries + q * kBlockCounts, lanes);
        bits = bits << 16U | std::uint64_t{1} << q;
      }
      const __m128i sums = Pair::reduce(lanes);
      const __m128i reaches = _mm_cmpeq_epi16(_mm_max_epu16(sums, need), sums);
      const __m128i queries_here = _mm_set1_epi64x(static_cast<std::int64_t>(bits));
      found = _mm_or_si128(found, _mm_and_si128(reaches, queries_here));
      best = _mm_max_epu16(best, sums);
    }
    best = _mm_max_epu16(best, _mm_srli_epi64(best, 32));
    best = _mm_max_epu16(best, _mm_srli_epi64(best, 16));
    found = _mm_or_si128(found, _mm_srli_epi64(found, 32));
    found = _mm_or_si128(found, _mm_srli_epi64(found, 16));
    reached[i] = {static_cast<std::uint16_t>(_mm_extract_epi16(best, 0)),
                  static_cast<std::uint16_t>(_mm_extract_epi16(found, 0))};
    reached[second] = {static_cast<std::uint16_t>(_mm_extract_epi16(best, 4)),
                       static_cast<std::uint16_t>(_mm_extract_epi16(found, 4))};
  }
}

}  // namespace loopbit
