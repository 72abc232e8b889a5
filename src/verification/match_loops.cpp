// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled once for each instruction set that has no source of its own, see loopbit_kernels().
#include "match_kernels.hpp"

namespace loopbit {
namespace {

#if defined(__ARM_FEATURE_DOTPROD)
/// SDOT multiplies and adds 16 bytes.
std::int32_t dot(const std::int8_t* a, const std::int8_t* b) {
  std::int32_t sum = 0;
  for (std::size_t k = 0; k < kDescriptorSize; ++k) sum += a[k] * b[k];
  return sum;
}
#else
/// Two products of at most 127 * 127 fit in 16 bits, of which vectors hold twice as many.
std::int32_t dot(const std::int8_t* a, const std::int8_t* b) {
  constexpr std::size_t kHalf = kDescriptorSize / 2;
  std::int32_t sum = 0;
  for (std::size_t k = 0; k < kHalf; ++k) {
    sum += static_cast<std::int16_t>(a[k] * b[k] + a[k + kHalf] * b[k + kHalf]);
  }
  return sum;
}
#endif

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

constexpr MatchKernels kMatchKernels{describe_constants, nearest_two};

}  // namespace

template <InstructionSet>
const MatchKernels& MatchKernels::compiled_for() {
  return kMatchKernels;
}
template const MatchKernels& MatchKernels::compiled_for<InstructionSet::LOOPBIT_INSTRUCTION_SET>();

}  // namespace loopbit
