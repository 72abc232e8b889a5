// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled once for each instruction set, as surf_loops.cpp is.
#include "epipolar_kernels.hpp"

namespace loopbit {
namespace {

using SampleLane = double[kSampleLanes];

/// Rows of the epipolar constraint, for the elements of F row by row.
void constrain(const PairSamples& samples, SampleLane (&rows)[kSamplePairs][9]) {
  for (std::size_t pair = 0; pair < kSamplePairs; ++pair) {
    SampleLane* row = rows[pair];
    for (std::size_t lane = 0; lane < kSampleLanes; ++lane) {
      const double x0 = samples.x0[pair][lane];
      const double y0 = samples.y0[pair][lane];
      const double z0 = samples.z0[pair][lane];
      const double x1 = samples.x1[pair][lane];
      const double y1 = samples.y1[pair][lane];
      const double z1 = samples.z1[pair][lane];
      row[0][lane] = x1 * x0;
      row[1][lane] = x1 * y0;
      row[2][lane] = x1 * z0;
      row[3][lane] = y1 * x0;
      row[4][lane] = y1 * y0;
      row[5][lane] = y1 * z0;
      row[6][lane] = z1 * x0;
      row[7][lane] = z1 * y0;
      row[8][lane] = z1 * z0;
    }
  }
}

/// Does to the columns behind i what makes column i of row i 1 and that of all other rows 0.
template <std::size_t i>
void eliminate_column(SampleLane (&rows)[kSamplePairs][9], std::int64_t* __restrict determined) {
  constexpr double kMinPivot = 1e-9;
  SampleLane pivot_row[9];
  SampleLane factor;
  for (std::size_t lane = 0; lane < kSampleLanes; ++lane) {
    const double pivot = rows[i][i][lane];
    const bool is_small = pivot < kMinPivot && pivot > -kMinPivot;
    determined[lane] = is_small ? 0 : determined[lane];
    factor[lane] = 1.0 / (is_small ? 1.0 : pivot);
  }
  for (std::size_t j = i + 1; j < 9; ++j) {
    for (std::size_t lane = 0; lane < kSampleLanes; ++lane) {
      pivot_row[j][lane] = rows[i][j][lane] * factor[lane];
      rows[i][j][lane] = pivot_row[j][lane];
    }
  }
  for (std::size_t k = 0; k < kSamplePairs; ++k) {
    if (k == i) continue;
    for (std::size_t j = i + 1; j < 9; ++j) {
      for (std::size_t lane = 0; lane < kSampleLanes; ++lane) {
        rows[k][j][lane] -= rows[k][i][lane] * pivot_row[j][lane];
      }
    }
  }
}

/// Brings the rows to [identity, rest], of which only the rest, the last two columns, is written.
/// Without a search for pivots, which 16 digits can do without.
void eliminate(SampleLane (&rows)[kSamplePairs][9], std::uint8_t* is_determined) {
  std::int64_t determined[kSampleLanes] = {1, 1, 1, 1, 1, 1, 1, 1};
  eliminate_column<0>(rows, determined);
  eliminate_column<1>(rows, determined);
  eliminate_column<2>(rows, determined);
  eliminate_column<3>(rows, determined);
  eliminate_column<4>(rows, determined);
  eliminate_column<5>(rows, determined);
  eliminate_column<6>(rows, determined);
  for (std::size_t lane = 0; lane < kSampleLanes; ++lane) {
    is_determined[lane] = static_cast<std::uint8_t>(determined[lane]);
  }
}

/// The sum over the elements of `a` of each times its cofactor in `b`, times `factor`.
void mixed_determinant(const SampleLane (&a)[9], const SampleLane (&b)[9], double factor,
                       double* __restrict result) {
  for (std::size_t i = 0; i < kSampleLanes; ++i) {
    const double upper = a[0][i] * (b[4][i] * b[8][i] - b[5][i] * b[7][i]) +
                         a[1][i] * (b[5][i] * b[6][i] - b[3][i] * b[8][i]) +
                         a[2][i] * (b[3][i] * b[7][i] - b[4][i] * b[6][i]);
    const double middle = a[3][i] * (b[2][i] * b[7][i] - b[1][i] * b[8][i]) +
                          a[4][i] * (b[0][i] * b[8][i] - b[2][i] * b[6][i]) +
                          a[5][i] * (b[1][i] * b[6][i] - b[0][i] * b[7][i]);
    const double lower = a[6][i] * (b[1][i] * b[5][i] - b[2][i] * b[4][i]) +
                         a[7][i] * (b[2][i] * b[3][i] - b[0][i] * b[5][i]) +
                         a[8][i] * (b[0][i] * b[4][i] - b[1][i] * b[3][i]);
    result[i] = factor * (upper + middle + lower);
  }
}

void solve_samples(const PairSamples& samples, EpipolarPencils& pencils) {
  SampleLane rows[kSamplePairs][9];
  constrain(samples, rows);
  eliminate(rows, pencils.is_determined);
  for (std::size_t lane = 0; lane < kSampleLanes; ++lane) {
    for (std::size_t i = 0; i < kSamplePairs; ++i) {
      pencils.f[i][lane] = -rows[i][7][lane];
      pencils.g[i][lane] = -rows[i][8][lane];
    }
    pencils.f[7][lane] = 1;
    pencils.f[8][lane] = 0;
    pencils.g[7][lane] = 0;
    pencils.g[8][lane] = 1;
  }
  constexpr double kThird = 1.0 / 3.0;
  mixed_determinant(pencils.f, pencils.f, kThird, pencils.determinant[0]);
  mixed_determinant(pencils.g, pencils.f, 1.0, pencils.determinant[1]);
  mixed_determinant(pencils.f, pencils.g, 1.0, pencils.determinant[2]);
  mixed_determinant(pencils.g, pencils.g, kThird, pencils.determinant[3]);
}

/// What one block of pairs adds to costs and inliers, where `left` of them count. Each array is a
/// parameter of its own, so that __restrict tells the compiler that none overlaps.
// NOLINTNEXTLINE(readability-function-size)
void score_block(const float* __restrict model, const float* __restrict x0,
                 const float* __restrict y0, const float* __restrict x1, const float* __restrict y1,
                 float max_error_sq, std::int32_t left, float* __restrict costs,
                 std::int32_t* __restrict inliers, std::uint8_t* __restrict is_inlier) {
  std::int32_t inlier[kPairBlock];
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(kPairBlock); ++i) {
    const float ax = model[0] * x0[i] + model[1] * y0[i] + model[2];
    const float ay = model[3] * x0[i] + model[4] * y0[i] + model[5];
    const float az = model[6] * x0[i] + model[7] * y0[i] + model[8];
    const float bx = model[0] * x1[i] + model[3] * y1[i] + model[6];
    const float by = model[1] * x1[i] + model[4] * y1[i] + model[7];
    const float error = x1[i] * ax + y1[i] * ay + az;
    const float gradient_sq = ax * ax + ay * ay + bx * bx + by * by;
    const float error_sq = error * error;
    // Where there is no gradient there is no distance, and no inlier.
    const bool is_near = error_sq < max_error_sq * gradient_sq;
    const float distance_sq = error_sq / (is_near ? gradient_sq : 1.0F);
    const float cost = is_near ? distance_sq : max_error_sq;
    costs[i] += i < left ? cost : 0.0F;
    inlier[i] = (is_near ? 1 : 0) & (i < left ? 1 : 0);
  }
  for (std::size_t i = 0; i < kPairBlock; ++i) inliers[i] += inlier[i];
  for (std::size_t i = 0; i < kPairBlock; ++i) is_inlier[i] = static_cast<std::uint8_t>(inlier[i]);
}

/// As score_block(), for directions.
// NOLINTNEXTLINE(readability-function-size)
void score_ray_block(const float* __restrict model, const float* __restrict x0,
                     const float* __restrict y0, const float* __restrict z0,
                     const float* __restrict x1, const float* __restrict y1,
                     const float* __restrict z1, const float* __restrict spread_sq0,
                     const float* __restrict spread_sq1, float xy_scale_sq, float max_error_sq,
                     std::int32_t left, float* __restrict costs, std::int32_t* __restrict inliers,
                     std::uint8_t* __restrict is_inlier) {
  std::int32_t inlier[kPairBlock];
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(kPairBlock); ++i) {
    const float ax = model[0] * x0[i] + model[1] * y0[i] + model[2] * z0[i];
    const float ay = model[3] * x0[i] + model[4] * y0[i] + model[5] * z0[i];
    const float az = model[6] * x0[i] + model[7] * y0[i] + model[8] * z0[i];
    const float bx = model[0] * x1[i] + model[3] * y1[i] + model[6] * z1[i];
    const float by = model[1] * x1[i] + model[4] * y1[i] + model[7] * z1[i];
    const float bz = model[2] * x1[i] + model[5] * y1[i] + model[8] * z1[i];
    const float error = x1[i] * ax + y1[i] * ay + z1[i] * az;
    const float gradient_sq = spread_sq1[i] * (xy_scale_sq * (ax * ax + ay * ay) + az * az) +
                              spread_sq0[i] * (xy_scale_sq * (bx * bx + by * by) + bz * bz);
    const float error_sq = error * error;
    const bool is_near = error_sq < max_error_sq * gradient_sq;
    const float distance_sq = error_sq / (is_near ? gradient_sq : 1.0F);
    const float cost = is_near ? distance_sq : max_error_sq;
    costs[i] += i < left ? cost : 0.0F;
    inlier[i] = (is_near ? 1 : 0) & (i < left ? 1 : 0);
  }
  for (std::size_t i = 0; i < kPairBlock; ++i) inliers[i] += inlier[i];
  for (std::size_t i = 0; i < kPairBlock; ++i) is_inlier[i] = static_cast<std::uint8_t>(inlier[i]);
}

EpipolarScore sum_of(const float* costs, const std::int32_t* inliers) {
  EpipolarScore score = {0.0F, 0};
  for (std::size_t i = 0; i < kPairBlock; ++i) {
    score.cost += costs[i];
    score.inliers += inliers[i];
  }
  return score;
}

EpipolarScore epipolar_score(const float* model, const PointPairs& pairs, float max_error_sq,
                             std::uint8_t* is_inlier) {
  float costs[kPairBlock] = {};
  std::int32_t inliers[kPairBlock] = {};
  for (std::size_t i = 0; i < pairs.count; i += kPairBlock) {
    score_block(model, pairs.x0 + i, pairs.y0 + i, pairs.x1 + i, pairs.y1 + i, max_error_sq,
                static_cast<std::int32_t>(pairs.count - i), costs, inliers, is_inlier + i);
  }
  return sum_of(costs, inliers);
}

EpipolarScore ray_score(const float* model, const PointPairs& pairs, const RaySpreads& spreads,
                        float max_error_sq, std::uint8_t* is_inlier) {
  float costs[kPairBlock] = {};
  std::int32_t inliers[kPairBlock] = {};
  for (std::size_t i = 0; i < pairs.count; i += kPairBlock) {
    score_ray_block(model, pairs.x0 + i, pairs.y0 + i, pairs.z0 + i, pairs.x1 + i, pairs.y1 + i,
                    pairs.z1 + i, spreads.sq0 + i, spreads.sq1 + i, spreads.xy_scale_sq,
                    max_error_sq, static_cast<std::int32_t>(pairs.count - i), costs, inliers,
                    is_inlier + i);
  }
  return sum_of(costs, inliers);
}

constexpr EpipolarKernels kEpipolarKernels{solve_samples, epipolar_score, ray_score};

}  // namespace

template <InstructionSet>
const EpipolarKernels& EpipolarKernels::compiled_for() {
  return kEpipolarKernels;
}
template const EpipolarKernels&
EpipolarKernels::compiled_for<InstructionSet::LOOPBIT_INSTRUCTION_SET>();

}  // namespace loopbit
