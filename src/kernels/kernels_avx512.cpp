// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled with -mavx512f -mavx512bw -mavx512vpopcntdq: nothing here may run before the processor
// was asked.
#include <immintrin.h>

#include "kernel_variants.hpp"
#include "surf_loops.hpp"

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

}  // namespace

const Kernels kAvx512Kernels{"avx512", max_overlaps<overlap>, dot_products,
    integral_row, hessian_row, maxima_row, cell_means, describe};

}  // namespace loopbit
