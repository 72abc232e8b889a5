// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled with -mavx512f -mavx512bw -mavx512vpopcntdq: nothing here may run before the processor
// was asked.
#include <immintrin.h>

#include "kernel_variants.hpp"

namespace loopbit {
namespace {

constexpr std::size_t kWordsPerRegister = 8;

int overlap(const std::uint64_t* a, const std::uint64_t* b) {
  __m512i sums = _mm512_setzero_si512();
  for (std::size_t word = 0; word < kContentWords; word += kWordsPerRegister) {
    const __m512i both =
        _mm512_and_si512(_mm512_loadu_si512(a + word), _mm512_loadu_si512(b + word));
    sums = _mm512_add_epi64(sums, _mm512_popcnt_epi64(both));
  }
  return static_cast<int>(_mm512_reduce_add_epi64(sums));
}

__m512i widen(const std::int8_t* values) {
  return _mm512_cvtepi8_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(values)));
}

void dot_products(const std::int8_t* descriptor, const std::int8_t* descriptors,
                  std::size_t num_descriptors, std::int32_t* products) {
  const __m512i low = widen(descriptor);
  const __m512i high = widen(descriptor + 32);
  for (std::size_t i = 0; i < num_descriptors; ++i) {
    const std::int8_t* b = descriptors + i * kDescriptorSize;
    products[i] = _mm512_reduce_add_epi32(
        _mm512_add_epi32(_mm512_madd_epi16(low, widen(b)), _mm512_madd_epi16(high, widen(b + 32))));
  }
}

struct Counts {
  __m512i low;
  __m512i high;
};

Counts load_counts(const std::uint8_t* counts) {
  return {_mm512_loadu_si512(counts), _mm512_loadu_si512(counts + kBlockCounts / 2)};
}

/// The sum of the minima, in eight parts.
__m512i min_sum_lanes(const Counts& a, const Counts& b) {
  const __m512i minima =
      _mm512_add_epi8(_mm512_min_epu8(a.low, b.low), _mm512_min_epu8(a.high, b.high));
  return _mm512_sad_epu8(minima, _mm512_setzero_si512());
}

/// The sums with four records that follow each other, in the low four of the 16-bit lanes: side by
/// side, one reduction serves them all.
__m128i min_sums_with_four(const Counts& a, const std::uint8_t* records) {
  const auto lanes = [&](std::size_t i) {
    return min_sum_lanes(a, load_counts(records + i * kBlockCounts));
  };
  const __m512i low = _mm512_or_si512(lanes(0), _mm512_slli_epi64(lanes(1), 16));
  const __m512i high =
      _mm512_or_si512(_mm512_slli_epi64(lanes(2), 32), _mm512_slli_epi64(lanes(3), 48));
  const __m512i all = _mm512_or_si512(low, high);
  const __m256i half =
      _mm256_add_epi16(_mm512_castsi512_si256(all), _mm512_extracti64x4_epi64(all, 1));
  const __m128i sum =
      _mm_add_epi16(_mm256_castsi256_si128(half), _mm256_extracti128_si256(half, 1));
  return _mm_add_epi16(sum, _mm_unpackhi_epi64(sum, _mm_setzero_si128()));
}

/// The largest sum of several queries with one record, four queries at a time.
std::uint16_t max_min_sum(const std::uint8_t* queries, std::size_t num_queries,
                          const std::uint8_t* record) {
  const Counts counts = load_counts(record);
  __m128i best = _mm_setzero_si128();
  std::size_t q = 0;
  for (; q + 4 <= num_queries; q += 4) {
    best = _mm_max_epu16(best, min_sums_with_four(counts, queries + q * kBlockCounts));
  }
  for (; q < num_queries; ++q) {
    const __m512i lanes = min_sum_lanes(counts, load_counts(queries + q * kBlockCounts));
    best = _mm_max_epu16(best, _mm_cvtsi32_si128(static_cast<int>(_mm512_reduce_add_epi64(lanes))));
  }
  best = _mm_max_epu16(best, _mm_srli_epi64(best, 32));
  best = _mm_max_epu16(best, _mm_srli_epi64(best, 16));
  return static_cast<std::uint16_t>(_mm_extract_epi16(best, 0));
}

void max_min_sums(const std::uint8_t* queries, std::size_t num_queries, const std::uint8_t* records,
                  std::size_t num_records, std::uint16_t* largest) {
  std::size_t i = 0;
  for (; i + 4 <= num_records; i += 4) {
    __m128i best = _mm_setzero_si128();
    for (std::size_t q = 0; q < num_queries; ++q) {
      const Counts query = load_counts(queries + q * kBlockCounts);
      best = _mm_max_epu16(best, min_sums_with_four(query, records + i * kBlockCounts));
    }
    _mm_storel_epi64(reinterpret_cast<__m128i*>(largest + i), best);
  }
  for (; i < num_records; ++i) {
    largest[i] = max_min_sum(queries, num_queries, records + i * kBlockCounts);
  }
}

}  // namespace

const Kernels kAvx512Kernels{"avx512", max_overlaps<overlap>, dot_products, max_min_sums};

}  // namespace loopbit
