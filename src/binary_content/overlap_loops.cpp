// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled once for each instruction set that has no source of its own, see loopbit_kernels().
#include "overlap_kernels.hpp"

namespace loopbit {
namespace {

int overlap(const std::uint64_t* a, const std::uint64_t* b) {
  int set = 0;
  for (std::size_t word = 0; word < kContentWords; ++word) {
    set += __builtin_popcountll(a[word] & b[word]);
  }
  return set;
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
