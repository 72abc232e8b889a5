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

struct Record {
  __m512i low;
  __m512i high;
};

Record load_record(const std::uint8_t* record) {
  return {_mm512_loadu_si512(record), _mm512_loadu_si512(record + kBlockCounts / 2)};
}

/// The sum over one record, in eight parts.
__m512i min_sum_lanes(const Record& query, const Record& record) {
  const __m512i sums = _mm512_add_epi8(_mm512_min_epu8(query.low, record.low),
                                       _mm512_min_epu8(query.high, record.high));
  return _mm512_sad_epu8(sums, _mm512_setzero_si512());
}

/// Four records side by side in 16-bit lanes, so that one reduction serves them all.
void min_sums_of_four(const Record& query, const Record* records, std::uint16_t* sums) {
  const __m512i a = min_sum_lanes(query, records[0]);
  const __m512i b = _mm512_slli_epi64(min_sum_lanes(query, records[1]), 16);
  const __m512i c = _mm512_slli_epi64(min_sum_lanes(query, records[2]), 32);
  const __m512i d = _mm512_slli_epi64(min_sum_lanes(query, records[3]), 48);
  const __m512i all = _mm512_or_si512(_mm512_or_si512(a, b), _mm512_or_si512(c, d));
  const __m256i half =
      _mm256_add_epi16(_mm512_castsi512_si256(all), _mm512_extracti64x4_epi64(all, 1));
  __m128i sum = _mm_add_epi16(_mm256_castsi256_si128(half), _mm256_extracti128_si256(half, 1));
  sum = _mm_add_epi16(sum, _mm_unpackhi_epi64(sum, sum));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(sums), sum);
}

void min_sums(const std::uint8_t* const* queries, std::size_t num_queries,
              const std::uint8_t* records, std::size_t num_records, std::uint16_t* sums) {
  std::size_t i = 0;
  for (; i + 4 <= num_records; i += 4) {
    const std::uint8_t* first = records + i * kBlockCounts;
    const Record four[] = {load_record(first), load_record(first + kBlockCounts),
                           load_record(first + 2 * kBlockCounts),
                           load_record(first + 3 * kBlockCounts)};
    for (std::size_t q = 0; q < num_queries; ++q) {
      min_sums_of_four(load_record(queries[q]), four, sums + q * num_records + i);
    }
  }
  for (; i < num_records; ++i) {
    const Record record = load_record(records + i * kBlockCounts);
    for (std::size_t q = 0; q < num_queries; ++q) {
      const __m512i lanes = min_sum_lanes(load_record(queries[q]), record);
      sums[q * num_records + i] = static_cast<std::uint16_t>(_mm512_reduce_add_epi64(lanes));
    }
  }
}

}  // namespace

const Kernels kAvx512Kernels{"avx512", max_overlaps<overlap>, dot_products, min_sums};

}  // namespace loopbit
