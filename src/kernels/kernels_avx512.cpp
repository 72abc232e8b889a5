// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled with AVX-512 F, BW, DQ, VL, VNNI and VPOPCNTDQ: nothing here may run before the
// processor was asked.
#include <immintrin.h>

#include "epipolar_loops.inc"
#include "kernel_variants.hpp"
#include "min_sums_x86.hpp"
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
// adds is a constant of the other side. Distances are kept with the number of their descriptor in
// the lowest bits, so that the smallest of them tells both.

constexpr std::size_t kChunks = kDescriptorSize / 4;
constexpr std::size_t kAtOnce = 12;  // chains that hide the latency of VPDPBUSD
/// Descriptors are numbered in runs of so many. A distance takes 23 bits.
constexpr int kNumberBits = 8;
constexpr std::size_t kNumbers = std::size_t{1} << kNumberBits;

__m512i raised(__m512i bytes) { return _mm512_xor_si512(bytes, _mm512_set1_epi8(-128)); }

/// Numbers of which the sum is |p|^2 + 2 * 128 * sum of p.
__m512i constant_parts(const std::int8_t* descriptor) {
  const __m512i p = _mm512_loadu_si512(descriptor);
  // (p + 128) p + 128 p
  return _mm512_dpbusd_epi32(_mm512_dpbusd_epi32(_mm512_setzero_si512(), raised(p), p),
                             _mm512_set1_epi8(-128), p);
}

/// Of each two numbers, from `a` and `b` in turn.
__m512i pair_sums(__m512i a, __m512i b) {
  return _mm512_add_epi32(_mm512_unpacklo_epi32(a, b), _mm512_unpackhi_epi32(a, b));
}

/// Of descriptors from number i on, with room for their numbers, and these.
__m128i numbered(__m128i constants, std::size_t i) {
  const __m128i numbers =
      _mm_add_epi32(_mm_set1_epi32(static_cast<int>(i % kNumbers)), _mm_setr_epi32(0, 1, 2, 3));
  return _mm_or_si128(_mm_slli_epi32(constants, kNumberBits), numbers);
}

void describe_constants(const std::int8_t* descriptors, std::size_t num_descriptors,
                        std::int32_t* constants) {
  std::size_t i = 0;
  for (; i + 4 <= num_descriptors; i += 4) {
    const std::int8_t* first = descriptors + i * kDescriptorSize;
    const __m512i even = pair_sums(constant_parts(first), constant_parts(first + kDescriptorSize));
    const __m512i odd = pair_sums(constant_parts(first + 2 * kDescriptorSize),
                                  constant_parts(first + 3 * kDescriptorSize));
    const __m512i quarters =
        _mm512_add_epi32(_mm512_unpacklo_epi64(even, odd), _mm512_unpackhi_epi64(even, odd));
    const __m256i halves =
        _mm256_add_epi32(_mm512_castsi512_si256(quarters), _mm512_extracti64x4_epi64(quarters, 1));
    const __m128i sums =
        _mm_add_epi32(_mm256_castsi256_si128(halves), _mm256_extracti128_si256(halves, 1));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(constants + i), numbered(sums, i));
  }
  for (; i < num_descriptors; ++i) {
    const int sum = _mm512_reduce_add_epi32(constant_parts(descriptors + i * kDescriptorSize));
    constants[i] = _mm_cvtsi128_si32(numbered(_mm_cvtsi32_si128(sum), i));
  }
}

__m512i chunk(const std::int8_t* descriptor, std::size_t number) {
  std::int32_t bytes = 0;
  __builtin_memcpy(&bytes, descriptor + 4 * number, sizeof bytes);
  return _mm512_set1_epi32(bytes);
}

/// The two smallest numbers offered to each lane.
struct SmallestTwo {
  __m512i smallest = _mm512_set1_epi32(NearestTwo::kNone);
  __m512i second = smallest;

  void offer(__m512i numbers) {
    second = _mm512_min_epi32(second, _mm512_max_epi32(smallest, numbers));
    smallest = _mm512_min_epi32(smallest, numbers);
  }
};

/// Offers the squared distances of 16 raised descriptors to Count others, less |descriptor|^2.
template <std::size_t Count>
void offer_distances(const __m512i (&lanes)[kChunks], const std::int8_t* others,
                     const std::int32_t* constants, SmallestTwo& two) {
  __m512i products[Count];
  for (std::size_t i = 0; i < Count; ++i) products[i] = _mm512_setzero_si512();
#pragma GCC unroll 16
  for (std::size_t c = 0; c < kChunks; ++c) {
#pragma GCC unroll 16
    for (std::size_t i = 0; i < Count; ++i) {
      products[i] =
          _mm512_dpbusd_epi32(products[i], lanes[c], chunk(others + i * kDescriptorSize, c));
    }
  }
  for (std::size_t i = 0; i < Count; ++i) {
    const __m512i twice = _mm512_slli_epi32(products[i], kNumberBits + 1);
    two.offer(_mm512_sub_epi32(_mm512_set1_epi32(constants[i]), twice));
  }
}

/// The nearest two of one run of others.
SmallestTwo nearest_two_of_run(const __m512i (&lanes)[kChunks], const std::int8_t* others,
                               const std::int32_t* constants, std::size_t num_others) {
  SmallestTwo two;
  std::size_t i = 0;
  for (; i + kAtOnce <= num_others; i += kAtOnce) {
    offer_distances<kAtOnce>(lanes, others + i * kDescriptorSize, constants + i, two);
  }
  for (; i < num_others; ++i) {
    offer_distances<1>(lanes, others + i * kDescriptorSize, constants + i, two);
  }
  return two;
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
  const auto distance_of = [&](__m512i numbered) {
    const __mmask16 is_any = _mm512_cmpneq_epi32_mask(numbered, none);
    return _mm512_mask_add_epi32(none, is_any, _mm512_srai_epi32(numbered, kNumberBits), squares);
  };
  SmallestTwo distances;
  __m512i index = _mm512_setzero_si512();
  for (std::size_t begin = 0; begin < num_others; begin += kNumbers) {
    const std::size_t count = num_others - begin < kNumbers ? num_others - begin : kNumbers;
    const SmallestTwo run =
        nearest_two_of_run(lanes, others + begin * kDescriptorSize, constants + begin, count);
    const __m512i distance = distance_of(run.smallest);
    const __mmask16 is_nearer = _mm512_cmplt_epi32_mask(distance, distances.smallest);
    const __m512i number =
        _mm512_and_si512(run.smallest, _mm512_set1_epi32(static_cast<int>(kNumbers - 1)));
    index =
        _mm512_mask_add_epi32(index, is_nearer, number, _mm512_set1_epi32(static_cast<int>(begin)));
    distances.offer(distance);
    distances.offer(distance_of(run.second));
  }
  _mm512_store_si512(nearest.index, index);
  _mm512_store_si512(nearest.distance_sq, distances.smallest);
  _mm512_store_si512(nearest.second_distance_sq, distances.second);
}

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
      const auto* query = reinterpret_cast<const std::int8_t*>(queries + q * kCoarseCounts);
      const __m512i both = _mm512_add_epi8(_mm512_min_epu8(low, chunk(query, c)),
                                           _mm512_min_epu8(high, chunk(query, d)));
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

}  // namespace

const Kernels kAvx512Kernels{"avx512",
                             max_overlaps<overlap>,
                             reaching_queries<Pair>,
                             coarse_sums,
                             select_records,
                             describe_constants,
                             nearest_two,
                             add_pixels,
                             linear_row,
                             integral_row,
                             hessian_row,
                             maxima_row,
                             upright_cells,
                             describe,
                             solve_samples,
                             epipolar_score};

}  // namespace loopbit
