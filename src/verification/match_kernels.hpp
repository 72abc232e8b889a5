// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "loopbit/descriptor.hpp"
#include "loopbit/instruction_set.hpp"

namespace loopbit {

/// Descriptors whose neighbours are sought at once.
inline constexpr std::size_t kMatchLanes = 16;

/// Numbers that a kernel may keep of each descriptor.
inline constexpr std::size_t kMatchConstants = 3;

/// The neighbours of kMatchLanes descriptors by squared distance; of equals, the first is nearest.
struct NearestTwo {
  static constexpr std::int32_t kNone = 0x7fffffff;

  alignas(64) std::int32_t index[kMatchLanes];
  alignas(64) std::int32_t distance_sq[kMatchLanes];         ///< kNone if there is no other
  alignas(64) std::int32_t second_distance_sq[kMatchLanes];  ///< kNone if there is only one
};

/// The inner loops of matching, for one instruction set.
struct MatchKernels {
  template <InstructionSet>
  static const MatchKernels& compiled_for();

  /// Finds what nearest_two of the same table has to know of these descriptors. `constants` has
  /// room for kMatchConstants * num_descriptors.
  void (*describe_constants)(const std::int8_t* descriptors, std::size_t num_descriptors,
                             std::int32_t* constants);

  /// The nearest and second nearest of `others` for each of 16 descriptors. `constants` are of all
  /// `others`. Cost: 16 * num_others products of 64 values.
  void (*nearest_two)(const std::int8_t* descriptors, const std::int8_t* others,
                      const std::int32_t* constants, std::size_t num_others, NearestTwo& nearest);
};

}  // namespace loopbit
