// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Nothing here may run before the processor was asked for AVX-512.
#include <immintrin.h>

#include "match_kernels.hpp"

namespace loopbit {
namespace {

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

constexpr MatchKernels kMatchKernels{describe_constants, nearest_two};

}  // namespace

template <InstructionSet>
const MatchKernels& MatchKernels::compiled_for() {
  return kMatchKernels;
}
template const MatchKernels& MatchKernels::compiled_for<InstructionSet::LOOPBIT_INSTRUCTION_SET>();

}  // namespace loopbit
