// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace loopbit {

/// What inner loops are compiled for. Every instruction set gives the same bits.
enum class InstructionSet : std::uint8_t {
  scalar,   ///< what every processor of its kind has; the reference
  avx2,     ///< x86-64 with AVX2
  avx512,   ///< x86-64 with AVX-512 F, BW, DQ, VL, VNNI and VPOPCNTDQ
  dotprod,  ///< 64-bit Arm with the dot product extension
};

/// "scalar", "avx2", "avx512" or "dotprod".
[[nodiscard]] std::string_view to_string(InstructionSet instruction_set);

/// The instruction sets of this processor, slowest first.
[[nodiscard]] std::span<const InstructionSet> available_instruction_sets();

/// The fastest of them, or the one that the environment variable LOOPBIT_KERNEL names (unless
/// empty) when this is first called. Throws Error (kind option) if that one is unknown or cannot
/// run here.
[[nodiscard]] InstructionSet active_instruction_set();

}  // namespace loopbit
