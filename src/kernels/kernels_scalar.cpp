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

void min_sums(const std::uint8_t* const* queries, std::size_t num_queries,
              const std::uint8_t* records, std::size_t num_records, std::uint16_t* sums) {
  for (std::size_t q = 0; q < num_queries; ++q) {
    for (std::size_t i = 0; i < num_records; ++i) {
      const std::uint8_t* record = records + i * kBlockCounts;
      unsigned sum = 0;
      for (std::size_t k = 0; k < kBlockCounts; ++k) {
        sum += queries[q][k] < record[k] ? queries[q][k] : record[k];
      }
      sums[q * num_records + i] = static_cast<std::uint16_t>(sum);
    }
  }
}

}  // namespace

const Kernels kScalarKernels{"scalar", max_overlaps<overlap>, dot_products, min_sums};

}  // namespace loopbit
