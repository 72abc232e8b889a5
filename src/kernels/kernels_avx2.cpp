// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled with -mavx2: nothing here may run before the processor was asked.
#include <immintrin.h>

#include "epipolar_loops.inc"
#include "kernel_variants.hpp"
#include "min_sums_x86.hpp"
#include "surf_loops.inc"

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

// Matching. VPMADDUBSW multiplies unsigned by signed bytes; |a| times b with the sign of a is the
// product, and two products of at most 127 * 127 fit in its 16 bits.

constexpr std::size_t kChunks = kDescriptorSize / 4;
constexpr std::size_t kLanes = 8;

/// For each lane, the sum of the products of its 4 bytes.
__m256i products_of_4(__m256i magnitudes, __m256i signs, __m256i bytes) {
  const __m256i pairs = _mm256_maddubs_epi16(magnitudes, _mm256_sign_epi8(bytes, signs));
  return _mm256_madd_epi16(pairs, _mm256_set1_epi16(1));
}

void describe_constants(const std::int8_t* descriptors, std::size_t num_descriptors,
                        std::int32_t* constants) {
  for (std::size_t i = 0; i < num_descriptors; ++i) {
    const __m256i low = load(descriptors + i * kDescriptorSize);
    const __m256i high = load(descriptors + i * kDescriptorSize + 32);
    const __m256i sums = _mm256_add_epi32(products_of_4(_mm256_abs_epi8(low), low, low),
                                          products_of_4(_mm256_abs_epi8(high), high, high));
    __m128i half = _mm_add_epi32(_mm256_castsi256_si128(sums), _mm256_extracti128_si256(sums, 1));
    half = _mm_add_epi32(half, _mm_shuffle_epi32(half, _MM_SHUFFLE(1, 0, 3, 2)));
    half = _mm_add_epi32(half, _mm_shuffle_epi32(half, _MM_SHUFFLE(2, 3, 0, 1)));
    constants[i] = _mm_cvtsi128_si32(half);
  }
}

/// 8 descriptors, chunk by chunk of 4 bytes.
struct Lanes {
  __m256i bytes[kChunks];
  __m256i magnitudes[kChunks];
  __m256i squares;  ///< of their lengths
};

void transpose(const std::int8_t* descriptors, Lanes& lanes) {
  const __m256i first_bytes = _mm256_mullo_epi32(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7),
                                                 _mm256_set1_epi32(kDescriptorSize));
  lanes.squares = _mm256_setzero_si256();
  for (std::size_t c = 0; c < kChunks; ++c) {
    const auto* bytes = reinterpret_cast<const int*>(descriptors + 4 * c);
    lanes.bytes[c] = _mm256_i32gather_epi32(bytes, first_bytes, 1);
    lanes.magnitudes[c] = _mm256_abs_epi8(lanes.bytes[c]);
    lanes.squares =
        _mm256_add_epi32(lanes.squares, products_of_4(lanes.magnitudes[c], lanes.bytes[c],  //
                                                      lanes.bytes[c]));
  }
}

struct BestTwo {
  __m256i index;
  __m256i best;
  __m256i second;

  void offer(__m256i distances, std::int32_t number) {
    const __m256i nearer = _mm256_cmpgt_epi32(best, distances);
    second = _mm256_min_epi32(second, _mm256_max_epi32(best, distances));
    best = _mm256_min_epi32(best, distances);
    index = _mm256_blendv_epi8(index, _mm256_set1_epi32(number), nearer);
  }
};

/// Offers the descriptors from `others` on, as many as Count.
template <std::size_t Count>
void offer_products(const Lanes& lanes, const std::int8_t* others, const std::int32_t* constants,
                    std::int32_t number, BestTwo& two) {
  __m256i sums[Count];
  for (std::size_t i = 0; i < Count; ++i) sums[i] = _mm256_setzero_si256();
  for (std::size_t c = 0; c < kChunks; ++c) {
    for (std::size_t i = 0; i < Count; ++i) {
      std::int32_t chunk = 0;
      __builtin_memcpy(&chunk, others + i * kDescriptorSize + 4 * c, sizeof chunk);
      sums[i] = _mm256_add_epi32(
          sums[i], products_of_4(lanes.magnitudes[c], lanes.bytes[c], _mm256_set1_epi32(chunk)));
    }
  }
  for (std::size_t i = 0; i < Count; ++i) {
    const __m256i squares = _mm256_add_epi32(lanes.squares, _mm256_set1_epi32(constants[i]));
    two.offer(_mm256_sub_epi32(squares, _mm256_add_epi32(sums[i], sums[i])),
              number + static_cast<std::int32_t>(i));
  }
}

/// nearest_two for 8 of the 16 descriptors.
void nearest_two_of_8(const Lanes& lanes, const std::int8_t* others, const std::int32_t* constants,
                      std::size_t num_others, std::size_t first, NearestTwo& nearest) {
  constexpr std::size_t kAtOnce = 4;
  const __m256i none = _mm256_set1_epi32(NearestTwo::kNone);
  BestTwo two{_mm256_setzero_si256(), none, none};
  std::size_t i = 0;
  for (; i + kAtOnce <= num_others; i += kAtOnce) {
    offer_products<kAtOnce>(lanes, others + i * kDescriptorSize, constants + i,
                            static_cast<std::int32_t>(i), two);
  }
  for (; i < num_others; ++i) {
    offer_products<1>(lanes, others + i * kDescriptorSize, constants + i,
                      static_cast<std::int32_t>(i), two);
  }
  const auto store = [&](std::int32_t* to, __m256i values) {
    _mm256_store_si256(reinterpret_cast<__m256i*>(to + first), values);
  };
  store(nearest.index, two.index);
  store(nearest.distance_sq, two.best);
  store(nearest.second_distance_sq, two.second);
}

void nearest_two(const std::int8_t* descriptors, const std::int8_t* others,
                 const std::int32_t* constants, std::size_t num_others, NearestTwo& nearest) {
  for (std::size_t first = 0; first < kMatchLanes; first += kLanes) {
    Lanes lanes;
    transpose(descriptors + first * kDescriptorSize, lanes);
    nearest_two_of_8(lanes, others, constants, num_others, first, nearest);
  }
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
      const __m256i packed = load(record + byte);
      const __m256i lower = _mm256_and_si256(packed, low_nibbles);
      const __m256i upper = _mm256_and_si256(_mm256_srli_epi16(packed, 4), low_nibbles);
      __m256i* const part = parts + 2 * byte / kPackedRun;
      part[0] = _mm256_shuffle_epi8(counts, lower);
      part[1] = _mm256_shuffle_epi8(counts, upper);
    }
  }

  static __m256i beside(__m256i sums, const Parts& parts, const std::uint8_t* query) {
    const auto minimum = [&](std::size_t i) {
      return _mm256_min_epu8(parts[i], load(query + i * kPackedRun));
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

/// The sums of the minima of a query with 8 records, in 32-bit lanes.
__m256i coarse_sums_with_eight(const std::uint8_t* query, const std::uint8_t* half,
                               const CoarseChunks& chunks) {
  const auto minimum = [&](std::size_t chunk) {
    return _mm256_min_epu8(load(half + chunk * kInterleaved * kCountsAtOnce),
                           four_counts(query, chunk * kCountsAtOnce));
  };
  __m256i sums = _mm256_setzero_si256();
  for (std::size_t i = 0; i < chunks.size; i += 2) {
    const __m256i both =
        _mm256_add_epi8(minimum(chunks.numbers[i]), minimum(chunks.numbers[i + 1]));
    sums = _mm256_add_epi16(sums, _mm256_maddubs_epi16(both, _mm256_set1_epi8(1)));
  }
  return _mm256_madd_epi16(sums, _mm256_set1_epi16(1));
}

void largest_coarse_sums(const std::uint8_t* queries, std::size_t num_queries,
                         const std::uint8_t* groups, std::size_t num_groups, std::uint16_t* sums,
                         std::uint16_t* largest) {
  constexpr std::size_t kHalf = kInterleaved / 2 * kCountsAtOnce;
  const CoarseChunks chunks = chunks_of(queries, num_queries);
  for (std::size_t group = 0; group < num_groups; ++group) {
    const std::uint8_t* counts = groups + group * kInterleaved * kCoarseCounts;
    __m256i low = _mm256_setzero_si256();
    __m256i high = _mm256_setzero_si256();
    for (std::size_t q = 0; q < num_queries; ++q) {
      const std::uint8_t* query = queries + q * kCoarseCounts;
      low = _mm256_max_epi32(low, coarse_sums_with_eight(query, counts, chunks));
      high = _mm256_max_epi32(high, coarse_sums_with_eight(query, counts + kHalf, chunks));
    }
    // Packing takes halves of the registers in turn.
    const __m256i best =
        _mm256_permute4x64_epi64(_mm256_packus_epi32(low, high), _MM_SHUFFLE(3, 1, 2, 0));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(sums + group * kInterleaved), best);
    largest[group] = largest_of_16(best);
  }
}

std::size_t select_sums(const std::uint16_t* sums, const std::uint16_t* largest,
                        std::size_t num_groups, std::uint16_t lower, std::uint16_t upper,
                        std::uint32_t* numbers) {
  const __m256i first = _mm256_set1_epi16(static_cast<std::int16_t>(lower - 1));
  const __m256i last = _mm256_set1_epi16(static_cast<std::int16_t>(upper));
  std::size_t selected = 0;
  for (std::size_t group = 0; group < num_groups; ++group) {
    if (largest[group] < lower) continue;
    const std::size_t i = group * kInterleaved;
    const __m256i here = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(sums + i));
    const __m256i between =
        _mm256_and_si256(_mm256_cmpgt_epi16(here, first), _mm256_cmpgt_epi16(last, here));
    const __m128i bytes =
        _mm_packs_epi16(_mm256_castsi256_si128(between), _mm256_extracti128_si256(between, 1));
    for (auto left = static_cast<std::uint32_t>(_mm_movemask_epi8(bytes)); left != 0;
         left &= left - 1) {
      numbers[selected++] =
          static_cast<std::uint32_t>(i) + static_cast<std::uint32_t>(__builtin_ctz(left));
    }
  }
  return selected;
}

}  // namespace

const Kernels kAvx2Kernels{"avx2",
                           max_overlaps<overlap>,
                           reaching_queries<Pair>,
                           largest_coarse_sums,
                           select_sums,
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
