// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Nothing here may run before the processor was asked for AVX2.
#include <immintrin.h>

#include "match_kernels.hpp"

namespace loopbit {
namespace {

__m256i load_descriptors(const void* address) {
  return _mm256_loadu_si256(static_cast<const __m256i*>(address));
}

// Matching. VPMADDUBSW multiplies unsigned by signed bytes; |a| times b with the sign of a is the
// product, and two products of at most 127 * 127 fit in its 16 bits. Distances are kept with the
// number of their descriptor in the lowest bits, so that the smallest of them tells both.
//
// Descriptors as describe() makes them are regular: no sum of dx or dy is larger than that of |dx|
// or |dy|, and |a|^2 < 2^16. Of two regular ones the products dx dx' + |dx| |dx'| are not negative,
// nor is a sum of them, which is at most |a| |b|: it fits in 16 bits, whatever overflows on the
// way.
//
// With a raised to a + r, which is not negative, no signs need to change hands: (a + r) b is too
// large by r b, whose sum is r times a constant of b. This holds as long as two products fit in 16
// bits, which is why constants tell how wide the descriptor is: the largest |b| + |b'| of any two
// signed values side by side.

constexpr std::size_t kChunks = kDescriptorSize / 4;
constexpr std::size_t kLanes = 8;
constexpr std::size_t kKinds = 4;   // of sums in a row of bins: dx, dy, |dx|, |dy|, a chunk of each
constexpr std::size_t kSigned = 2;  // of them
constexpr std::size_t kAtOnce = 4;  // whose sums with 16 descriptors there are registers for
/// Descriptors are numbered in runs of so many. A distance takes 23 bits.
constexpr int kNumberBits = 8;
constexpr std::size_t kNumbers = std::size_t{1} << kNumberBits;
/// In the constant of a descriptor that is not regular.
constexpr std::int32_t kIrregular = 1 << 30;

/// What is known of others: three numbers of each, one kind after the other.
struct Constants {
  const std::int32_t* squares;  ///< with the descriptor's number in the lowest bits
  const std::int32_t* sums;     ///< of signed values: two parts of 16 bits, as of products
  const std::int32_t* widths;

  [[nodiscard]] Constants from(std::size_t first) const {
    return {squares + first, sums + first, widths + first};
  }
};

/// For each lane, the sum of its two 16-bit parts.
__m256i sum_of_parts(__m256i parts) { return _mm256_madd_epi16(parts, _mm256_set1_epi16(1)); }

/// What a distance loses by a product of 1, with the number in its lowest bits.
constexpr std::int32_t kTwice = 2 << kNumberBits;
/// Products in 16-bit parts are kept less 2^15, so that VPMADDWD can add the two parts.
constexpr std::int16_t kPartOffset = -0x8000;
constexpr std::int32_t kTwiceOffsets = 2 * kPartOffset * kTwice;

/// 8 descriptors, chunk by chunk of 4 bytes.
struct Lanes {
  __m256i bytes[kChunks];
  __m256i magnitudes[kChunks];
  __m256i squares;     ///< of their lengths
  __m256i is_regular;  ///< all bits or none
};

/// Half of each of 8 descriptors.
void transpose(const std::int8_t* descriptors, __m256i* chunks) {
  __m256i pairs[kLanes];
  for (std::size_t i = 0; i < kLanes; i += 2) {
    const __m256i a = load_descriptors(descriptors + i * kDescriptorSize);
    const __m256i b = load_descriptors(descriptors + (i + 1) * kDescriptorSize);
    pairs[i] = _mm256_unpacklo_epi32(a, b);
    pairs[i + 1] = _mm256_unpackhi_epi32(a, b);
  }
  for (std::size_t i = 0; i < 2; ++i) {  // chunks 2 i, 2 i + 1, and four later
    const __m256i low_first = _mm256_unpacklo_epi64(pairs[i], pairs[i + 2]);
    const __m256i low_next = _mm256_unpackhi_epi64(pairs[i], pairs[i + 2]);
    const __m256i high_first = _mm256_unpacklo_epi64(pairs[i + 4], pairs[i + 6]);
    const __m256i high_next = _mm256_unpackhi_epi64(pairs[i + 4], pairs[i + 6]);
    chunks[2 * i] = _mm256_permute2x128_si256(low_first, high_first, 0x20);
    chunks[2 * i + 1] = _mm256_permute2x128_si256(low_next, high_next, 0x20);
    chunks[2 * i + 4] = _mm256_permute2x128_si256(low_first, high_first, 0x31);
    chunks[2 * i + 5] = _mm256_permute2x128_si256(low_next, high_next, 0x31);
  }
}

void lay_side_by_side(const std::int8_t* descriptors, Lanes& lanes) {
  transpose(descriptors, lanes.bytes);
  transpose(descriptors + kDescriptorSize / 2, lanes.bytes + kChunks / 2);
  lanes.squares = _mm256_setzero_si256();
  __m256i too_small = _mm256_setzero_si256();
  for (std::size_t c = 0; c < kChunks; ++c) {
    const __m256i magnitudes = _mm256_abs_epi8(lanes.bytes[c]);
    lanes.magnitudes[c] = magnitudes;
    lanes.squares =
        _mm256_add_epi32(lanes.squares, sum_of_parts(_mm256_maddubs_epi16(magnitudes, magnitudes)));
    if (c % kKinds >= kSigned) continue;
    const __m256i above = _mm256_cmpgt_epi8(magnitudes, lanes.bytes[c + kSigned]);
    too_small = _mm256_or_si256(too_small, above);
  }
  const __m256i too_long = _mm256_cmpgt_epi32(lanes.squares, _mm256_set1_epi32(0xFFFF));
  const __m256i large_enough = _mm256_cmpeq_epi32(too_small, _mm256_setzero_si256());
  lanes.is_regular = _mm256_andnot_si256(too_long, large_enough);
}

/// Of 8 descriptors, of which the first is number `first` of all.
__m256i numbered_squares(const Lanes& lanes, std::size_t first) {
  const __m256i numbers =
      _mm256_add_epi32(_mm256_set1_epi32(static_cast<std::int32_t>(first % kNumbers)),
                       _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
  const __m256i flags = _mm256_andnot_si256(lanes.is_regular, _mm256_set1_epi32(kIrregular));
  const __m256i squares = _mm256_slli_epi32(lanes.squares, kNumberBits);
  return _mm256_or_si256(_mm256_or_si256(squares, numbers), flags);
}

/// See Constants.
struct SignedValues {
  explicit SignedValues(const Lanes& lanes) {
    const __m256i ones = _mm256_set1_epi8(1);
    for (std::size_t row = 0; row < kChunks; row += kKinds) {
      for (std::size_t c = row; c < row + kSigned; ++c) {
        sums = _mm256_add_epi16(sums, _mm256_maddubs_epi16(ones, lanes.bytes[c]));
        widths = _mm256_max_epi16(widths, _mm256_maddubs_epi16(ones, lanes.magnitudes[c]));
      }
    }
    widths = _mm256_max_epi16(_mm256_srli_epi32(widths, 16),
                              _mm256_and_si256(widths, _mm256_set1_epi32(0xFFFF)));
  }

  __m256i sums = _mm256_setzero_si256();
  __m256i widths = _mm256_setzero_si256();
};

/// Stores the constants of `count` descriptors, at most 8, of which the first is number `first`.
void describe_8(const std::int8_t* descriptors, std::size_t first, std::size_t count,
                std::size_t num_descriptors, std::int32_t* constants) {
  Lanes lanes;
  lay_side_by_side(descriptors, lanes);
  const SignedValues values(lanes);
  const __m256i of_lanes[] = {numbered_squares(lanes, first), values.sums, values.widths};
  for (std::size_t kind = 0; kind < kMatchConstants; ++kind) {
    std::int32_t* to = constants + kind * num_descriptors + first;
    if (count == kLanes) {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), of_lanes[kind]);
    } else {
      __builtin_memcpy(to, &of_lanes[kind], count * sizeof *to);
    }
  }
}

void describe_constants(const std::int8_t* descriptors, std::size_t num_descriptors,
                        std::int32_t* constants) {
  std::size_t i = 0;
  for (; i + kLanes <= num_descriptors; i += kLanes) {
    describe_8(descriptors + i * kDescriptorSize, i, kLanes, num_descriptors, constants);
  }
  if (i == num_descriptors) return;
  std::int8_t last[kLanes * kDescriptorSize] = {};
  __builtin_memcpy(last, descriptors + i * kDescriptorSize,
                   (num_descriptors - i) * kDescriptorSize);
  describe_8(last, i, num_descriptors - i, num_descriptors, constants);
}

/// 16 descriptors, and by how much their signed values are raised.
struct Query {
  explicit Query(const std::int8_t* descriptors) {
    lay_side_by_side(descriptors, halves[0]);
    lay_side_by_side(descriptors + kLanes * kDescriptorSize, halves[1]);
    __m256i largest = _mm256_setzero_si256();
    for_signed([&](const Lanes& half, std::size_t c) {
      largest = _mm256_max_epu8(largest, half.magnitudes[c]);
    });
    std::uint8_t values[sizeof largest];
    __builtin_memcpy(values, &largest, sizeof largest);
    for (const std::uint8_t value : values) raise = raise > value ? raise : value;
    const __m256i raises = _mm256_set1_epi8(static_cast<char>(raise));
    for (std::size_t i = 0; i < 2; ++i) {
      for (std::size_t c = 0; c < kChunks; ++c) {
        raised[i][c] = halves[i].bytes[c];
        if (c % kKinds < kSigned) raised[i][c] = _mm256_add_epi8(raised[i][c], raises);
      }
    }
    constexpr std::int32_t kLargestSum = 0x7FFF;
    max_width = raise == 0 ? kLargestSum : kLargestSum / (2 * raise);
  }

  template <typename Visit>
  void for_signed(const Visit& visit) const {
    for (const Lanes& half : halves) {
      for (std::size_t c = 0; c < kChunks; ++c) {
        if (c % kKinds < kSigned) visit(half, c);
      }
    }
  }

  [[nodiscard]] bool is_regular() const {
    const __m256i both = _mm256_and_si256(halves[0].is_regular, halves[1].is_regular);
    return _mm256_testc_si256(both, _mm256_set1_epi32(-1)) != 0;
  }

  Lanes halves[2];
  __m256i raised[2][kChunks];
  std::int32_t raise = 0;
  std::int32_t max_width = 0;  ///< of others with which two products fit in 16 bits
};

/// The two smallest numbers offered to each lane.
struct SmallestTwo {
  __m256i smallest = _mm256_set1_epi32(NearestTwo::kNone);
  __m256i second = smallest;

  void offer(__m256i numbers) {
    second = _mm256_min_epi32(second, _mm256_max_epi32(smallest, numbers));
    smallest = _mm256_min_epi32(smallest, numbers);
  }
};

/// How products are computed.
enum class Products {
  raised,   ///< see above
  regular,  ///< in 16 bits, for regular descriptors that are too wide
  any,
};

/// Adds the products of a chunk to `sums`: in 16-bit parts, except of any descriptors.
template <Products Kind, bool IsSigned>
void add_products(const Query& query, std::size_t half, std::size_t chunk, __m256i other,
                  __m256i& sums) {
  if constexpr (Kind == Products::raised) {
    sums = _mm256_add_epi16(sums, _mm256_maddubs_epi16(query.raised[half][chunk], other));
  } else {
    const Lanes& lanes = query.halves[half];
    if (IsSigned || Kind == Products::any) other = _mm256_sign_epi8(other, lanes.bytes[chunk]);
    const __m256i products = _mm256_maddubs_epi16(lanes.magnitudes[chunk], other);
    sums = Kind == Products::any ? _mm256_add_epi32(sums, sum_of_parts(products))
                                 : _mm256_add_epi16(sums, products);
  }
  // Products that are added later would need registers that there are not.
  asm("" : "+x"(sums));
}

/// What the sums of products begin with, see Products::raised.
template <Products Kind>
__m256i first_sums(const Query& query, std::int32_t sums) {
  if constexpr (Kind == Products::any) return _mm256_setzero_si256();
  const __m256i offsets = _mm256_set1_epi16(kPartOffset);
  if constexpr (Kind == Products::regular) return offsets;
  const __m256i raises = _mm256_set1_epi16(static_cast<std::int16_t>(query.raise));
  return _mm256_sub_epi16(offsets, _mm256_mullo_epi16(_mm256_set1_epi32(sums), raises));
}

/// A squared distance less |descriptor|^2, with the number of the other.
template <Products Kind>
__m256i distances(std::int32_t squares, __m256i sums) {
  if constexpr (Kind == Products::any) {
    const __m256i constant = _mm256_set1_epi32(squares & ~kIrregular);
    return _mm256_sub_epi32(constant, _mm256_slli_epi32(sums, kNumberBits + 1));
  }
  const __m256i products = _mm256_madd_epi16(sums, _mm256_set1_epi16(kTwice));
  return _mm256_sub_epi32(_mm256_set1_epi32(squares + kTwiceOffsets), products);
}

/// Offers the squared distances of 16 descriptors to Count others, less |descriptor|^2.
template <Products Kind, std::size_t Count>
void offer_distances(const Query& query, const std::int8_t* others, const Constants& constants,
                     SmallestTwo* two) {
  __m256i sums[2][Count];
  for (std::size_t i = 0; i < Count; ++i) {
    sums[0][i] = sums[1][i] = first_sums<Kind>(query, constants.sums[i]);
  }
  for (std::size_t row = 0; row < kChunks; row += kKinds) {
    const auto add_kind = [&]<bool IsSigned>(std::size_t kind) {
#pragma GCC unroll 4
      for (std::size_t i = 0; i < Count; ++i) {
        std::int32_t chunk = 0;
        __builtin_memcpy(&chunk, others + i * kDescriptorSize + 4 * (row + kind), sizeof chunk);
        const __m256i other = _mm256_set1_epi32(chunk);
        add_products<Kind, IsSigned>(query, 0, row + kind, other, sums[0][i]);
        add_products<Kind, IsSigned>(query, 1, row + kind, other, sums[1][i]);
      }
    };
    for (std::size_t kind = 0; kind < kSigned; ++kind) add_kind.template operator()<true>(kind);
    for (std::size_t kind = kSigned; kind < kKinds; ++kind) {
      add_kind.template operator()<false>(kind);
    }
  }
  for (std::size_t i = 0; i < Count; ++i) {
    two[0].offer(distances<Kind>(constants.squares[i], sums[0][i]));
    two[1].offer(distances<Kind>(constants.squares[i], sums[1][i]));
  }
}

/// Offers Count regular others.
template <std::size_t Count>
void offer_regular(const Query& query, const std::int8_t* others, const Constants& constants,
                   SmallestTwo* two) {
  std::int32_t width = 0;
  for (std::size_t i = 0; i < Count; ++i) {
    width = width > constants.widths[i] ? width : constants.widths[i];
  }
  if (width <= query.max_width) {
    offer_distances<Products::raised, Count>(query, others, constants, two);
  } else {
    offer_distances<Products::regular, Count>(query, others, constants, two);
  }
}

template <std::size_t Count>
void offer_any(const Query& query, const std::int8_t* others, const Constants& constants,
               SmallestTwo* two) {
  offer_distances<Products::any, Count>(query, others, constants, two);
}

/// The nearest two of one run of others.
template <bool IsRegular>
void nearest_two_of_run(const Query& query, const std::int8_t* others, const Constants& constants,
                        std::size_t num_others, SmallestTwo* two) {
  constexpr auto kOfferSome = IsRegular ? offer_regular<kAtOnce> : offer_any<kAtOnce>;
  constexpr auto kOfferOne = IsRegular ? offer_regular<1> : offer_any<1>;
  std::size_t i = 0;
  for (; i + kAtOnce <= num_others; i += kAtOnce) {
    kOfferSome(query, others + i * kDescriptorSize, constants.from(i), two);
  }
  for (; i < num_others; ++i) {
    kOfferOne(query, others + i * kDescriptorSize, constants.from(i), two);
  }
}

bool are_regular(const std::int32_t* squares, std::size_t num_others) {
  std::int32_t any = 0;
  for (std::size_t i = 0; i < num_others; ++i) any |= squares[i];
  return (any & kIrregular) == 0;
}

/// The nearest two of 8 of the 16 descriptors, those from `first` on.
struct NearestOfHalf {
  SmallestTwo distances;
  __m256i index = _mm256_setzero_si256();

  /// What is nearest among the others from number `begin` on.
  void offer_run(const SmallestTwo& run, __m256i squares, std::size_t begin) {
    const __m256i none = _mm256_set1_epi32(NearestTwo::kNone);
    const auto distance_of = [&](__m256i numbered) {
      const __m256i distance = _mm256_add_epi32(_mm256_srai_epi32(numbered, kNumberBits), squares);
      return _mm256_blendv_epi8(distance, none, _mm256_cmpeq_epi32(numbered, none));
    };
    const __m256i distance = distance_of(run.smallest);
    const __m256i number =
        _mm256_and_si256(run.smallest, _mm256_set1_epi32(static_cast<int>(kNumbers - 1)));
    index = _mm256_blendv_epi8(index,
                               _mm256_add_epi32(number, _mm256_set1_epi32(static_cast<int>(begin))),
                               _mm256_cmpgt_epi32(distances.smallest, distance));
    distances.offer(distance);
    distances.offer(distance_of(run.second));
  }

  void store(std::size_t first, NearestTwo& nearest) const {
    const auto store_lanes = [&](std::int32_t* to, __m256i values) {
      _mm256_store_si256(reinterpret_cast<__m256i*>(to + first), values);
    };
    store_lanes(nearest.index, index);
    store_lanes(nearest.distance_sq, distances.smallest);
    store_lanes(nearest.second_distance_sq, distances.second);
  }
};

void nearest_two(const std::int8_t* descriptors, const std::int8_t* others,
                 const std::int32_t* constants, std::size_t num_others, NearestTwo& nearest) {
  const Query query(descriptors);
  const Constants of_others{constants, constants + num_others, constants + 2 * num_others};
  const bool regular = query.is_regular() && are_regular(of_others.squares, num_others);
  const auto search = regular ? nearest_two_of_run<true> : nearest_two_of_run<false>;
  NearestOfHalf found[2];
  for (std::size_t begin = 0; begin < num_others; begin += kNumbers) {
    const std::size_t count = num_others - begin < kNumbers ? num_others - begin : kNumbers;
    SmallestTwo run[2];
    search(query, others + begin * kDescriptorSize, of_others.from(begin), count, run);
    found[0].offer_run(run[0], query.halves[0].squares, begin);
    found[1].offer_run(run[1], query.halves[1].squares, begin);
  }
  found[0].store(0, nearest);
  found[1].store(kLanes, nearest);
}

constexpr MatchKernels kMatchKernels{describe_constants, nearest_two};

}  // namespace

template <InstructionSet>
const MatchKernels& MatchKernels::compiled_for() {
  return kMatchKernels;
}
template const MatchKernels& MatchKernels::compiled_for<InstructionSet::LOOPBIT_INSTRUCTION_SET>();

}  // namespace loopbit
