// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <bit>

#include "kernel_variants.hpp"

namespace loopbit {
namespace {

int overlap(const std::uint64_t* a, const std::uint64_t* b) {
  int set = 0;
  for (std::size_t word = 0; word < kContentWords; ++word) set += std::popcount(a[word] & b[word]);
  return set;
}

void dot_products(const std::int8_t* descriptor, const std::int8_t* descriptors,
                  std::size_t num_descriptors, std::int32_t* products) {
  for (std::size_t i = 0; i < num_descriptors; ++i) {
    const std::int8_t* other = descriptors + i * kDescriptorSize;
    std::int32_t sum = 0;
    for (std::size_t k = 0; k < kDescriptorSize; ++k) sum += descriptor[k] * other[k];
    products[i] = sum;
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

const Kernels kScalarKernels{"scalar", max_overlaps<overlap>, dot_products, max_min_sums};

}  // namespace loopbit
