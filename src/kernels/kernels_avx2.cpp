// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled with -mavx2: nothing here may run before the processor was asked.
#include <immintrin.h>

#include "kernel_variants.hpp"

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

__m256i widen(const std::int8_t* values) {
  return _mm256_cvtepi8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(values)));
}

int sum_lanes_epi32(__m256i lanes) {
  __m128i sums = _mm_add_epi32(_mm256_castsi256_si128(lanes), _mm256_extracti128_si256(lanes, 1));
  sums = _mm_add_epi32(sums, _mm_shuffle_epi32(sums, _MM_SHUFFLE(1, 0, 3, 2)));
  sums = _mm_add_epi32(sums, _mm_shuffle_epi32(sums, _MM_SHUFFLE(2, 3, 0, 1)));
  return _mm_cvtsi128_si32(sums);
}

void dot_products(const std::int8_t* descriptor, const std::int8_t* descriptors,
                  std::size_t num_descriptors, std::int32_t* products) {
  const __m256i a0 = widen(descriptor);
  const __m256i a1 = widen(descriptor + 16);
  const __m256i a2 = widen(descriptor + 32);
  const __m256i a3 = widen(descriptor + 48);
  for (std::size_t i = 0; i < num_descriptors; ++i) {
    const std::int8_t* b = descriptors + i * kDescriptorSize;
    const __m256i low =
        _mm256_add_epi32(_mm256_madd_epi16(a0, widen(b)), _mm256_madd_epi16(a1, widen(b + 16)));
    const __m256i high = _mm256_add_epi32(_mm256_madd_epi16(a2, widen(b + 32)),
                                          _mm256_madd_epi16(a3, widen(b + 48)));
    products[i] = sum_lanes_epi32(_mm256_add_epi32(low, high));
  }
}

/// The sum over one record, in four parts.
__m256i min_sum_lanes(const std::uint8_t* query, const std::uint8_t* record) {
  const auto minimum = [&](std::size_t at) {
    return _mm256_min_epu8(load(query + at), load(record + at));
  };
  const __m256i low = _mm256_add_epi8(minimum(0), minimum(32));
  const __m256i high = _mm256_add_epi8(minimum(64), minimum(96));
  const __m256i zero = _mm256_setzero_si256();
  return _mm256_add_epi64(_mm256_sad_epu8(low, zero), _mm256_sad_epu8(high, zero));
}

/// Four records side by side in 16-bit lanes, so that one reduction serves them all.
void min_sums_of_four(const std::uint8_t* query, const std::uint8_t* records, std::uint16_t* sums) {
  const __m256i a = min_sum_lanes(query, records);
  const __m256i b = _mm256_slli_epi64(min_sum_lanes(query, records + kBlockCounts), 16);
  const __m256i c = _mm256_slli_epi64(min_sum_lanes(query, records + 2 * kBlockCounts), 32);
  const __m256i d = _mm256_slli_epi64(min_sum_lanes(query, records + 3 * kBlockCounts), 48);
  const __m256i all = _mm256_or_si256(_mm256_or_si256(a, b), _mm256_or_si256(c, d));
  __m128i sum = _mm_add_epi16(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1));
  sum = _mm_add_epi16(sum, _mm_unpackhi_epi64(sum, sum));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(sums), sum);
}

void min_sums(const std::uint8_t* const* queries, std::size_t num_queries,
              const std::uint8_t* records, std::size_t num_records, std::uint16_t* sums) {
  std::size_t i = 0;
  for (; i + 4 <= num_records; i += 4) {
    for (std::size_t q = 0; q < num_queries; ++q) {
      min_sums_of_four(queries[q], records + i * kBlockCounts, sums + q * num_records + i);
    }
  }
  for (; i < num_records; ++i) {
    for (std::size_t q = 0; q < num_queries; ++q) {
      const __m256i lanes = min_sum_lanes(queries[q], records + i * kBlockCounts);
      sums[q * num_records + i] = static_cast<std::uint16_t>(sum_lanes_epi64(lanes));
    }
  }
}

}  // namespace

const Kernels kAvx2Kernels{"avx2", max_overlaps<overlap>, dot_products, min_sums};

}  // namespace loopbit
