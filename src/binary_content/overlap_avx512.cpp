// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Nothing here may run before the processor was asked for AVX-512.
#include <immintrin.h>

#include "overlap_kernels.hpp"

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

constexpr OverlapKernels kOverlapKernels{max_overlaps_by<overlap>};

}  // namespace

template <InstructionSet>
const OverlapKernels& OverlapKernels::compiled_for() {
  return kOverlapKernels;
}
template const OverlapKernels&
OverlapKernels::compiled_for<InstructionSet::LOOPBIT_INSTRUCTION_SET>();

}  // namespace loopbit
