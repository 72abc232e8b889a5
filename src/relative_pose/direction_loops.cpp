// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled once for each instruction set, as surf_loops.cpp is.
#include "direction_kernels.hpp"

namespace loopbit {
namespace {

/// The variance of a pair that no noise moves.
constexpr float kMinVariance = 1e-30F;

struct Vector {
  float x, y, z;
};

inline Vector cross(Vector a, Vector b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector plus(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vector scaled(Vector a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vector turned(const float* r, Vector v) {
  return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
          r[6] * v.x + r[7] * v.y + r[8] * v.z};
}
inline Vector turned_back(const float* r, Vector v) {
  return {r[0] * v.x + r[3] * v.y + r[6] * v.z, r[1] * v.x + r[4] * v.y + r[7] * v.z,
          r[2] * v.x + r[5] * v.y + r[8] * v.z};
}

/// A ray of pair i, whose numbers begin at `numbers`.
struct LaneRay {
  Vector direction;
  Vector spread0, spread1;  ///< the columns

  LaneRay(const float* __restrict numbers, std::size_t stride, std::size_t i)
      : direction{numbers[i], numbers[stride + i], numbers[2 * stride + i]},
        spread0{numbers[3 * stride + i], numbers[5 * stride + i], numbers[7 * stride + i]},
        spread1{numbers[4 * stride + i], numbers[6 * stride + i], numbers[8 * stride + i]} {}
};

/// Sampson's distance of a pair, and what leads to it: see epipolar_residual().
struct LaneError {
  Vector q, m, t;
  Vector normal_of_query, normal_of_match;
  Vector match_noise, query_noise;  ///< across the epipolar lines
  float scale, value;
};

inline LaneError lane_error(const DirectionPose& pose, const LaneRay& query, const LaneRay& match) {
  const Vector q = query.direction;
  const Vector m = turned_back(pose.rotation, match.direction);
  const Vector t = {pose.translation[0], pose.translation[1], pose.translation[2]};
  const Vector normal_of_query = cross(t, q);
  const Vector normal_of_match = cross(m, t);
  const Vector normal = turned(pose.rotation, normal_of_query);
  const float a0 = dot(match.spread0, normal);
  const float a1 = dot(match.spread1, normal);
  const float b0 = dot(query.spread0, normal_of_match);
  const float b1 = dot(query.spread1, normal_of_match);
  const float variance = a0 * a0 + a1 * a1 + b0 * b0 + b1 * b1;
  const float scale = 1.0F / __builtin_sqrtf(variance > kMinVariance ? variance : kMinVariance);
  return {q,
          m,
          t,
          normal_of_query,
          normal_of_match,
          plus(scaled(match.spread0, a0), scaled(match.spread1, a1)),
          plus(scaled(query.spread0, b0), scaled(query.spread1, b1)),
          scale,
          dot(m, normal_of_query) * scale};
}

/// What a block of pairs adds.
struct BlockTerms {
  float jacobian[6][kRayBlock];
  float weighted[6][kRayBlock];
  float residual[kRayBlock];
  float likelihood[kRayBlock];  ///< against that of a residual of 0, times 1 + outlier
};

/// Of `left` pairs; the others add nothing.
void differentiate(const DirectionPose& pose, const RayArrays& block, float outlier,
                   std::int32_t left, BlockTerms& __restrict terms) {
  constexpr float kFreedom = 3;
  const float* __restrict query = block.numbers;
  const float* __restrict match = query + RayArrays::kNumbers / 2 * block.stride;
  for (std::int32_t lane = 0; lane < static_cast<std::int32_t>(kRayBlock); ++lane) {
    const auto i = static_cast<std::size_t>(lane);
    const LaneError e =
        lane_error(pose, LaneRay(query, block.stride, i), LaneRay(match, block.stride, i));
    const Vector match_pull = scaled(turned_back(pose.rotation, e.match_noise), e.scale);
    const Vector query_pull = scaled(e.query_noise, e.scale);
    const Vector sigma_by_translation = plus(cross(e.q, match_pull), cross(query_pull, e.m));
    const Vector sigma_by_rotation =
        plus(cross(e.q, cross(match_pull, e.t)), cross(query_pull, e.normal_of_match));
    const Vector by_translation =
        scaled(plus(cross(e.q, e.m), scaled(sigma_by_translation, -e.value)), e.scale);
    const Vector by_rotation =
        scaled(plus(cross(e.q, e.normal_of_match), scaled(sigma_by_rotation, -e.value)), e.scale);
    const float share = 1.0F / (1.0F + e.value * e.value * (1 / kFreedom));
    const float inlier = share * share;
    const float total = inlier + outlier;
    const float weight = inlier / total * ((kFreedom + 1) / kFreedom) * share;
    const float used = lane < left ? weight : 0.0F;
    terms.likelihood[i] = lane < left ? total : 1.0F + outlier;
    terms.residual[i] = e.value;
    const float jacobian[6] = {by_translation.x, by_translation.y, by_translation.z,
                               by_rotation.x,    by_rotation.y,    by_rotation.z};
    for (std::size_t a = 0; a < 6; ++a) {
      terms.jacobian[a][i] = jacobian[a];
      terms.weighted[a][i] = used * jacobian[a];
    }
  }
}

/// Sums of every 16th pair.
struct LaneSums {
  float squares[DirectionSums::kSquares][kRayBlock];
  float gradient[6][kRayBlock];
};

void add(const BlockTerms& __restrict terms, LaneSums& __restrict sums) {
  std::size_t entry = 0;
  for (std::size_t a = 0; a < 6; ++a) {
    for (std::size_t b = 0; b <= a; ++b, ++entry) {
      for (std::size_t i = 0; i < kRayBlock; ++i) {
        sums.squares[entry][i] += terms.weighted[a][i] * terms.jacobian[b][i];
      }
    }
    for (std::size_t i = 0; i < kRayBlock; ++i) {
      sums.gradient[a][i] += terms.weighted[a][i] * terms.residual[i];
    }
  }
}

float sum_of(const float (&lanes)[kRayBlock]) {
  float eight[8];
  for (std::size_t i = 0; i < 8; ++i) eight[i] = lanes[i] + lanes[i + 8];
  float four[4];
  for (std::size_t i = 0; i < 4; ++i) four[i] = eight[i] + eight[i + 4];
  return (four[0] + four[2]) + (four[1] + four[3]);
}

void sum_up(const DirectionPose& pose, const RayArrays& pairs, float outlier, DirectionSums& sums) {
  LaneSums lanes = {};
  const double most = 1.0 / (1.0 + static_cast<double>(outlier));
  for (double& likelihood : sums.likelihoods) likelihood = 1;
  for (std::size_t i = 0; i < pairs.count; i += kRayBlock) {
    BlockTerms terms;
    differentiate(pose, {pairs.numbers + i, pairs.stride, kRayBlock}, outlier,
                  static_cast<std::int32_t>(pairs.count - i), terms);
    add(terms, lanes);
    for (std::size_t lane = 0; lane < kRayBlock; ++lane) {
      sums.likelihoods[lane] *= static_cast<double>(terms.likelihood[lane]) * most;
    }
  }
  for (std::size_t i = 0; i < DirectionSums::kSquares; ++i) {
    sums.squares[i] = sum_of(lanes.squares[i]);
  }
  for (std::size_t i = 0; i < 6; ++i) sums.gradient[i] = sum_of(lanes.gradient[i]);
}

void measure_block(const DirectionPose& pose, const RayArrays& block, float* errors_sq) {
  const float* __restrict query = block.numbers;
  const float* __restrict match = query + RayArrays::kNumbers / 2 * block.stride;
  float values[kRayBlock];
  for (std::int32_t lane = 0; lane < static_cast<std::int32_t>(kRayBlock); ++lane) {
    const auto i = static_cast<std::size_t>(lane);
    values[i] =
        lane_error(pose, LaneRay(query, block.stride, i), LaneRay(match, block.stride, i)).value;
  }
  for (std::size_t i = 0; i < kRayBlock; ++i) errors_sq[i] = values[i] * values[i];
}

void measure(const DirectionPose& pose, const RayArrays& pairs, float* errors_sq) {
  for (std::size_t i = 0; i < pairs.count; i += kRayBlock) {
    measure_block(pose, {pairs.numbers + i, pairs.stride, kRayBlock}, errors_sq + i);
  }
}

constexpr DirectionKernels kDirectionKernels{sum_up, measure};

}  // namespace

template <InstructionSet>
const DirectionKernels& DirectionKernels::compiled_for() {
  return kDirectionKernels;
}
template const DirectionKernels&
DirectionKernels::compiled_for<InstructionSet::LOOPBIT_INSTRUCTION_SET>();

}  // namespace loopbit
