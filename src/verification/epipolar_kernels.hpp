// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "loopbit/instruction_set.hpp"

namespace loopbit {

/// Pairs in a minimal sample for a fundamental matrix, and samples that are solved at once.
inline constexpr std::size_t kSamplePairs = 7;
inline constexpr std::size_t kSampleLanes = 8;

/// The points (x0, y0, z0) of one image and (x1, y1, z1) of the other, one column a sample. z is 1
/// for pixels.
struct PairSamples {
  alignas(64) float x0[kSamplePairs][kSampleLanes];
  alignas(64) float y0[kSamplePairs][kSampleLanes];
  alignas(64) float z0[kSamplePairs][kSampleLanes];
  alignas(64) float x1[kSamplePairs][kSampleLanes];
  alignas(64) float y1[kSamplePairs][kSampleLanes];
  alignas(64) float z1[kSamplePairs][kSampleLanes];
};

/// All matrices f + x g that fulfil the epipolar constraint of a sample's pairs, row by row, and
/// the coefficients of det(f + x g) by rising powers of x. One column a sample.
struct EpipolarPencils {
  alignas(64) double f[9][kSampleLanes];
  alignas(64) double g[9][kSampleLanes];
  alignas(64) double determinant[4][kSampleLanes];
  std::uint8_t is_determined[kSampleLanes];  ///< 0 where the pairs allow more matrices than these
};

/// Pairs of points in blocks: behind the last one there is room for a whole block. z is 1 for
/// pixels.
inline constexpr std::size_t kPairBlock = 16;
struct PointPairs {
  const float* x0 = nullptr;
  const float* y0 = nullptr;
  const float* z0 = nullptr;
  const float* x1 = nullptr;
  const float* y1 = nullptr;
  const float* z1 = nullptr;
  std::size_t count = 0;
};

/// Of pairs of directions (x, y, z), whose x and y may be in another unit than z.
struct RaySpreads {
  const float* sq0 = nullptr;  ///< what one pixel turns a direction by, rad^2, in blocks as well
  const float* sq1 = nullptr;
  float xy_scale_sq = 1;  ///< 1 / u^2, where (u x, u y, z) has the length 1
};

/// How well one matrix explains pairs: the sum of min(error^2, largest error^2), and
/// how many pairs have less than the largest error.
struct EpipolarScore {
  float cost = 0;
  std::int32_t inliers = 0;
};

/// The inner loops of EpipolarRansac, for one instruction set.
struct EpipolarKernels {
  template <InstructionSet>
  static const EpipolarKernels& compiled_for();

  /// The seven-point method (Hartley and Zisserman 2004, section 11.1.2) up to its cubic equation.
  /// Points are to be of the order of 1.
  void (*solve_samples)(const PairSamples& samples, EpipolarPencils& pencils);
  /// Scores a model of 9 elements, row by row, by the square of Sampson's distance (ibid., section
  /// 11.4.3). is_inlier[i] is 1 for inliers, else 0; whole blocks of it are written.
  EpipolarScore (*epipolar_score)(const float* model, const PointPairs& pairs, float max_error_sq,
                                  std::uint8_t* is_inlier);
  /// The same for directions: Sampson's distance on the sphere, in pixels at both of them.
  EpipolarScore (*ray_score)(const float* model, const PointPairs& pairs, const RaySpreads& spreads,
                             float max_error_sq, std::uint8_t* is_inlier);
};

}  // namespace loopbit
