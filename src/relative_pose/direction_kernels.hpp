// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "loopbit/instruction_set.hpp"

namespace loopbit {

/// Pairs of rays are in blocks: behind the last one there is room for a whole block.
inline constexpr std::size_t kRayBlock = 16;

/// Directions and spreads (row by row) of pairs of rays, each number in an array of its own. These
/// arrays lie one behind the other, `stride` apart.
struct RayArrays {
  static constexpr std::size_t kDirection = 3;
  static constexpr std::size_t kSpread = 6;
  static constexpr std::size_t kNumbers = 2 * (kDirection + kSpread);

  const float* numbers = nullptr;  ///< of the query, then of the match
  std::size_t stride = 0;
  std::size_t count = 0;
};

/// A pose as the inner loops read it.
struct DirectionPose {
  float rotation[9];     ///< row by row
  float translation[3];  ///< in the frame of the query's camera
};

/// Sums over all pairs.
struct DirectionSums {
  static constexpr std::size_t kSquares = 21;
  float squares[kSquares];  ///< the lower triangle of J^T W J, row by row
  float gradient[6];
  double likelihoods[kRayBlock];  ///< the product of every 16th pair, each against that of 0
};

/// The inner loops of a fit of rotation and direction, for one instruction set.
struct DirectionKernels {
  template <InstructionSet>
  static const DirectionKernels& compiled_for();

  /// `outlier`: the likelihood of an outlier, against that of an inlier with a residual of 0.
  void (*sum_up)(const DirectionPose& pose, const RayArrays& pairs, float outlier,
                 DirectionSums& sums);
  /// The squared residual of each pair, in standard deviations; whole blocks are written.
  void (*errors_sq)(const DirectionPose& pose, const RayArrays& pairs, float* errors_sq);
};

}  // namespace loopbit
