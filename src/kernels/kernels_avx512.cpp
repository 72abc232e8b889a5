// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled with AVX-512 F, BW, DQ, VL, VNNI and VPOPCNTDQ: nothing here may run before the
// processor was asked.
#include <immintrin.h>

#include "kernel_variants.hpp"
#include "surf_loops.inc"

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

// Matching. VPDPBUSD multiplies unsigned by signed bytes, so one side is raised by 128; what that
// adds is a constant of the other side.

constexpr std::size_t kChunks = kDescriptorSize / 4;
constexpr std::size_t kAtOnce = 4;  // chains of 8 that hide the latency of VPDPBUSD

__m512i raised(__m512i bytes) { return _mm512_xor_si512(bytes, _mm512_set1_epi8(-128)); }

/// |p|^2 + 2 * 128 * sum of p.
void describe_constants(const std::int8_t* descriptors, std::size_t num_descriptors,
                        std::int32_t* constants) {
  for (std::size_t i = 0; i < num_descriptors; ++i) {
    const __m512i p = _mm512_loadu_si512(descriptors + i * kDescriptorSize);
    // (p + 128) p + 128 p
    const __m512i sums = _mm512_dpbusd_epi32(
        _mm512_dpbusd_epi32(_mm512_setzero_si512(), raised(p), p), _mm512_set1_epi8(-128), p);
    constants[i] = _mm512_reduce_add_epi32(sums);
  }
}

/// The constant of a place minus twice its products with 16 raised descriptors: their squared
/// distances less |descriptor|^2.
__m512i relative_distances(__m512i constant, __m512i low, __m512i high) {
  const __m512i products = _mm512_add_epi32(low, high);
  return _mm512_sub_epi32(constant, _mm512_add_epi32(products, products));
}

__m512i chunk(const std::int8_t* descriptor, std::size_t number) {
  std::int32_t bytes = 0;
  __builtin_memcpy(&bytes, descriptor + 4 * number, sizeof bytes);
  return _mm512_set1_epi32(bytes);
}

struct BestTwo {
  __m512i index;
  __m512i best;
  __m512i second;

  void offer(__m512i distances, std::int32_t number) {
    const __mmask16 nearer = _mm512_cmplt_epi32_mask(distances, best);
    second = _mm512_min_epi32(second, _mm512_max_epi32(best, distances));
    best = _mm512_min_epi32(best, distances);
    index = _mm512_mask_mov_epi32(index, nearer, _mm512_set1_epi32(number));
  }
};

/// Offers the descriptors from `others` on, as many as Count.
template <std::size_t Count>
void offer_products(const __m512i (&lanes)[kChunks], const std::int8_t* others,
                    const std::int32_t* constants, std::int32_t number, BestTwo& two) {
  __m512i low[Count];
  __m512i high[Count];
  for (std::size_t i = 0; i < Count; ++i) low[i] = high[i] = _mm512_setzero_si512();
  for (std::size_t c = 0; c < kChunks / 2; ++c) {
    for (std::size_t i = 0; i < Count; ++i) {
      const std::int8_t* other = others + i * kDescriptorSize;
      low[i] = _mm512_dpbusd_epi32(low[i], lanes[c], chunk(other, c));
      high[i] = _mm512_dpbusd_epi32(high[i], lanes[c + kChunks / 2], chunk(other, c + kChunks / 2));
    }
  }
  for (std::size_t i = 0; i < Count; ++i) {
    two.offer(relative_distances(_mm512_set1_epi32(constants[i]), low[i], high[i]),
              number + static_cast<std::int32_t>(i));
  }
}

void nearest_two(const std::int8_t* descriptors, const std::int8_t* others,
                 const std::int32_t* constants, std::size_t num_others, NearestTwo& nearest) {
  const __m512i first_bytes =
      _mm512_mullo_epi32(_mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15),
                         _mm512_set1_epi32(static_cast<int>(kDescriptorSize)));
  __m512i lanes[kChunks];
  __m512i squares = _mm512_setzero_si512();
  __m512i sums = _mm512_setzero_si512();
  for (std::size_t c = 0; c < kChunks; ++c) {
    const __m512i bytes = _mm512_i32gather_epi32(first_bytes, descriptors + 4 * c, 1);
    lanes[c] = raised(bytes);
    squares = _mm512_dpbusd_epi32(squares, lanes[c], bytes);
    sums = _mm512_dpbusd_epi32(sums, _mm512_set1_epi8(-128), bytes);
  }
  squares = _mm512_sub_epi32(squares, sums);

  const __m512i none = _mm512_set1_epi32(NearestTwo::kNone);
  BestTwo two{_mm512_setzero_si512(), none, none};
  std::size_t i = 0;
  for (; i + kAtOnce <= num_others; i += kAtOnce) {
    offer_products<kAtOnce>(lanes, others + i * kDescriptorSize, constants + i,
                            static_cast<std::int32_t>(i), two);
  }
  for (; i < num_others; ++i) {
    offer_products<1>(lanes, others + i * kDescriptorSize, constants + i,
                      static_cast<std::int32_t>(i), two);
  }
  const auto absolute = [&](__m512i distances) {
    return _mm512_mask_add_epi32(none, _mm512_cmpneq_epi32_mask(distances, none), distances,
                                 squares);
  };
  _mm512_store_si512(nearest.index, two.index);
  _mm512_store_si512(nearest.distance_sq, absolute(two.best));
  _mm512_store_si512(nearest.second_distance_sq, absolute(two.second));
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

const Kernels kAvx512Kernels{
    "avx512",     max_overlaps<overlap>, max_min_sums, describe_constants, nearest_two,
    integral_row, hessian_row,           maxima_row,   cell_means,         describe};

}  // namespace loopbit
