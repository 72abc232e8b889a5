// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <bit>

#include "epipolar_loops.inc"
#include "kernel_variants.hpp"
#include "surf_loops.inc"

namespace loopbit {
namespace {

int overlap(const std::uint64_t* a, const std::uint64_t* b) {
  int set = 0;
  for (std::size_t word = 0; word < kContentWords; ++word) set += std::popcount(a[word] & b[word]);
  return set;
}

std::int32_t dot(const std::int8_t* a, const std::int8_t* b) {
  std::int32_t sum = 0;
  for (std::size_t k = 0; k < kDescriptorSize; ++k) sum += a[k] * b[k];
  return sum;
}

void describe_constants(const std::int8_t* descriptors, std::size_t num_descriptors,
                        std::int32_t* constants) {
  for (std::size_t i = 0; i < num_descriptors; ++i) {
    const std::int8_t* descriptor = descriptors + i * kDescriptorSize;
    constants[i] = dot(descriptor, descriptor);
  }
}

void nearest_two(const std::int8_t* descriptors, const std::int8_t* others,
                 const std::int32_t* constants, std::size_t num_others, NearestTwo& nearest) {
  for (std::size_t lane = 0; lane < kMatchLanes; ++lane) {
    const std::int8_t* descriptor = descriptors + lane * kDescriptorSize;
    const std::int32_t square = dot(descriptor, descriptor);
    std::int32_t index = 0;
    std::int32_t best = NearestTwo::kNone;
    std::int32_t second = NearestTwo::kNone;
    for (std::size_t i = 0; i < num_others; ++i) {
      const std::int32_t distance =
          square + constants[i] - 2 * dot(descriptor, others + i * kDescriptorSize);
      if (distance < best) {
        second = best;
        best = distance;
        index = static_cast<std::int32_t>(i);
      } else if (distance < second) {
        second = distance;
      }
    }
    nearest.index[lane] = index;
    nearest.distance_sq[lane] = best;
    nearest.second_distance_sq[lane] = second;
  }
}

/// The smaller of a count and one that is packed in 4 bits.
unsigned smaller(unsigned count, unsigned packed) {
  return packed == 15 || count < packed ? count : packed;
}

/// The sum of the minima of a query and a packed record.
unsigned packed_sum(const std::uint8_t* query, const std::uint8_t* record) {
  unsigned sum = 0;
  for (std::size_t byte = 0; byte < kPackedBytes; ++byte) {
    const std::size_t lower = byte + byte / kPackedRun * kPackedRun;
    const unsigned packed = record[byte];
    sum += smaller(query[lower], packed & 15U) + smaller(query[lower + kPackedRun], packed >> 4U);
  }
  return sum;
}

void reaching_queries(const std::uint8_t* queries, const std::uint16_t* among,
                      const std::uint8_t* const* records, std::size_t num_records,
                      const std::uint16_t* least, Reached* reached) {
  for (std::size_t i = 0; i < num_records; ++i) {
    const unsigned asked = among[i / 2];
    unsigned best = 0;
    unsigned bits = 0;
    for (std::size_t q = 0; asked >> q != 0; ++q) {
      if ((asked >> q & 1U) == 0) continue;
      const unsigned sum = packed_sum(queries + q * kBlockCounts, records[i]);
      best = sum > best ? sum : best;
      if (sum >= least[i]) bits |= 1U << q;
    }
    reached[i] = {static_cast<std::uint16_t>(best), static_cast<std::uint16_t>(bits)};
  }
}

/// The sum of the minima with record i of an interleaved group.
unsigned coarse_sum(const std::uint8_t* query, const std::uint8_t* group, std::size_t i) {
  unsigned sum = 0;
  for (std::size_t k = 0; k < kCoarseCounts; ++k) {
    const std::size_t first = k / kCountsAtOnce * kCountsAtOnce;
    const std::uint8_t count = group[first * kInterleaved + i * kCountsAtOnce + k - first];
    sum += query[k] < count ? query[k] : count;
  }
  return sum;
}

void largest_coarse_sums(const std::uint8_t* queries, std::size_t num_queries,
                         const std::uint8_t* groups, std::size_t num_groups, std::uint16_t* sums,
                         std::uint16_t* largest) {
  for (std::size_t group = 0; group < num_groups; ++group) {
    unsigned best_of_all = 0;
    for (std::size_t i = 0; i < kInterleaved; ++i) {
      unsigned best = 0;
      for (std::size_t q = 0; q < num_queries; ++q) {
        const unsigned sum = coarse_sum(queries + q * kCoarseCounts,
                                        groups + group * kInterleaved * kCoarseCounts, i);
        best = sum > best ? sum : best;
      }
      sums[group * kInterleaved + i] = static_cast<std::uint16_t>(best);
      best_of_all = best > best_of_all ? best : best_of_all;
    }
    largest[group] = static_cast<std::uint16_t>(best_of_all);
  }
}

std::size_t select_sums(const std::uint16_t* sums, const std::uint16_t* largest,
                        std::size_t num_groups, std::uint16_t lower, std::uint16_t upper,
                        std::uint32_t* numbers) {
  std::size_t selected = 0;
  for (std::size_t group = 0; group < num_groups; ++group) {
    if (largest[group] < lower) continue;
    for (std::size_t i = group * kInterleaved; i < (group + 1) * kInterleaved; ++i) {
      if (sums[i] >= lower && sums[i] < upper) numbers[selected++] = static_cast<std::uint32_t>(i);
    }
  }
  return selected;
}

}  // namespace

const Kernels kScalarKernels{"scalar",         max_overlaps<overlap>,
                             reaching_queries, largest_coarse_sums,
                             select_sums,      describe_constants,
                             nearest_two,      add_pixels,
                             linear_row,       integral_row,
                             hessian_row,      maxima_row,
                             upright_cells,    describe,
                             solve_samples,    epipolar_score};

}  // namespace loopbit
