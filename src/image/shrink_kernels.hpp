// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "loopbit/instruction_set.hpp"

namespace loopbit {

/// The inner loop of ImageShrinker, for one instruction set.
struct ShrinkKernels {
  template <InstructionSet>
  static const ShrinkKernels& compiled_for();

  /// sums[x] += weight * pixels[x], for weights up to 257.
  void (*add_pixels)(const std::uint8_t* pixels, std::size_t width, std::uint16_t weight,
                     std::uint32_t* sums);
};

}  // namespace loopbit
