// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled once for each instruction set, see loopbit_kernels().
#include "shrink_kernels.hpp"

namespace loopbit {
namespace {

void add_pixels(const std::uint8_t* __restrict pixels, std::size_t width, std::uint16_t weight,
                std::uint32_t* __restrict sums) {
  // 16 bits hold the products, and twice as many of them in a vector.
  for (std::size_t x = 0; x < width; ++x) {
    sums[x] += static_cast<std::uint16_t>(pixels[x] * weight);
  }
}

constexpr ShrinkKernels kShrinkKernels{add_pixels};

}  // namespace

template <InstructionSet>
const ShrinkKernels& ShrinkKernels::compiled_for() {
  return kShrinkKernels;
}
template const ShrinkKernels&
ShrinkKernels::compiled_for<InstructionSet::LOOPBIT_INSTRUCTION_SET>();

}  // namespace loopbit
