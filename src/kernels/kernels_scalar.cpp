// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <bit>

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

unsigned min_sum(const std::uint8_t* a, const std::uint8_t* b) {
  unsigned sum = 0;
  for (std::size_t k = 0; k < kBlockCounts; ++k) sum += a[k] < b[k] ? a[k] : b[k];
  return sum;
}

void max_min_sums(const std::uint8_t* queries, std::size_t num_queries, const std::uint8_t* records,
                  std::size_t num_records, std::uint16_t* largest) {
  for (std::size_t i = 0; i < num_records; ++i) {
    unsigned best = 0;
    for (std::size_t q = 0; q < num_queries; ++q) {
      const unsigned sum = min_sum(queries + q * kBlockCounts, records + i * kBlockCounts);
      best = sum > best ? sum : best;
    }
    largest[i] = static_cast<std::uint16_t>(best);
  }
}

}  // namespace

const Kernels kScalarKernels{
    "scalar",     max_overlaps<overlap>, max_min_sums, describe_constants, nearest_two,
    integral_row, hessian_row,           maxima_row,   cell_means,         describe};

}  // namespace loopbit
