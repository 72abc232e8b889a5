// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The loops of SURF, written once and compiled for each instruction set by the file that includes
// them: the compiler makes vector code of them, on x86-64 and on Arm alike. All of it has internal
// linkage, see kernel_variants.hpp. Sums are of integers, or of floats in an order that no vector
// width changes, and a * b + c is never contracted: every variant returns the same bits.
#pragma once

#include "loopbit/kernels.hpp"

namespace loopbit {
namespace {

/// Row `y` of the integral image from `pixels` and the running sums of each column.
void integral_row(const std::uint8_t* pixels, std::size_t width, std::uint32_t* column_sums,
                  std::uint32_t* even, std::uint32_t* odd) {
  for (std::size_t x = 0; x < width; ++x) column_sums[x] += pixels[x];
  std::uint32_t sum = 0;
  std::size_t x = 0;
  for (; x + 1 < width; x += 2) {
    even[x / 2] = sum;
    sum += column_sums[x];
    odd[x / 2] = sum;
    sum += column_sums[x + 1];
  }
  even[x / 2] = sum;
  if (x < width) odd[x / 2] = sum + column_sums[x];
}

/// Loops over samples go in blocks of 16, whole vectors of every width; what lies after the last
/// sample asked for is padding.
constexpr std::ptrdiff_t kBlock = 16;

constexpr std::ptrdiff_t whole_blocks(std::ptrdiff_t count) {
  return (count + kBlock - 1) / kBlock * kBlock;
}

/// Samples by which a filter of the widest lobe, 65 px, reaches over the ends of its run.
constexpr std::ptrdiff_t kRunMargin = 64;
constexpr std::ptrdiff_t kBandLength = kHessianRun + 2 * kRunMargin;

std::int32_t as_signed(std::uint32_t value) { return static_cast<std::int32_t>(value); }

/// Differences of whole rows of corners, even columns, then odd ones.
struct Bands {
  alignas(64) std::uint32_t xx[2][kBandLength];  ///< the rows of Dxx
  alignas(64) std::uint32_t yy[2][kBandLength];  ///< those of Dyy: outer - 3 * inner
  alignas(64) std::uint32_t xy[2][kBandLength];  ///< those of Dxy: upper - lower
};

/// The rows of corners that the filters of one lobe around row `y` meet.
struct FilterRows {
  FilterRows(const std::uint32_t* row_y, std::ptrdiff_t stride, std::ptrdiff_t lobe)
      : top(row_y + (1 - lobe) * stride),
        bottom(row_y + lobe * stride),
        outer0(row_y - (3 * lobe - 1) / 2 * stride),
        inner0(row_y - (lobe - 1) / 2 * stride),
        inner1(row_y + (lobe + 1) / 2 * stride),
        outer1(row_y + (3 * lobe + 1) / 2 * stride),
        upper0(row_y - lobe * stride),
        upper1(row_y),
        lower0(row_y + stride),
        lower1(row_y + (lobe + 1) * stride) {}

  const std::uint32_t* top;
  const std::uint32_t* bottom;
  const std::uint32_t* outer0;
  const std::uint32_t* inner0;
  const std::uint32_t* inner1;
  const std::uint32_t* outer1;
  const std::uint32_t* upper0;
  const std::uint32_t* upper1;
  const std::uint32_t* lower0;
  const std::uint32_t* lower1;
};

void make_bands(const FilterRows& rows, std::ptrdiff_t begin, std::ptrdiff_t end,
                std::uint32_t* __restrict xx, std::uint32_t* __restrict yy,
                std::uint32_t* __restrict xy) {
  for (std::ptrdiff_t block = begin; block < end; block += kBlock) {
    for (std::ptrdiff_t k = block; k < block + kBlock; ++k) xx[k] = rows.bottom[k] - rows.top[k];
    for (std::ptrdiff_t k = block; k < block + kBlock; ++k) {
      yy[k] = rows.outer1[k] - rows.outer0[k] - 3 * (rows.inner1[k] - rows.inner0[k]);
    }
    for (std::ptrdiff_t k = block; k < block + kBlock; ++k) {
      xy[k] = rows.upper1[k] - rows.upper0[k] - rows.lower1[k] + rows.lower0[k];
    }
  }
}

/// The columns at an offset from each sample's.
const std::uint32_t* at(const std::uint32_t (&band)[2][kBandLength], std::ptrdiff_t offset) {
  return band[offset & 1] + kRunMargin + (offset >> 1);
}

/// Bay et al. 2008, eq. 3; 0 where it is negative.
void combine_bands(const Bands& bands, std::ptrdiff_t count, std::ptrdiff_t lobe,
                   float* __restrict responses) {
  const float norm = 1.0F / static_cast<float>(9 * lobe * lobe);
  const std::ptrdiff_t outer = -(3 * lobe - 1) / 2;
  const std::ptrdiff_t inner = -(lobe - 1) / 2;
  const std::uint32_t* xx0 = at(bands.xx, outer);
  const std::uint32_t* xx1 = at(bands.xx, inner);
  const std::uint32_t* xx2 = at(bands.xx, inner + lobe);
  const std::uint32_t* xx3 = at(bands.xx, outer + 3 * lobe);
  const std::uint32_t* yy0 = at(bands.yy, 1 - lobe);
  const std::uint32_t* yy1 = at(bands.yy, lobe);
  const std::uint32_t* xy0 = at(bands.xy, -lobe);
  const std::uint32_t* xy1 = at(bands.xy, 0);
  const std::uint32_t* xy2 = at(bands.xy, 1);
  const std::uint32_t* xy3 = at(bands.xy, lobe + 1);
  for (std::ptrdiff_t block = 0; block < count; block += kBlock) {
    for (std::ptrdiff_t k = block; k < block + kBlock; ++k) {
      const std::uint32_t xx = xx3[k] - xx0[k] - 3 * (xx2[k] - xx1[k]);
      const std::uint32_t yy = yy1[k] - yy0[k];
      const std::uint32_t xy = xy1[k] - xy0[k] - xy3[k] + xy2[k];
      const float dxx = static_cast<float>(as_signed(xx)) * norm;
      const float dyy = static_cast<float>(as_signed(yy)) * norm;
      const float dxy = static_cast<float>(as_signed(xy)) * norm;
      const float determinant = dxx * dyy - 0.81F * (dxy * dxy);
      responses[k] = determinant > 0.0F ? determinant : 0.0F;
    }
  }
}

void hessian_row(const IntegralView& integral, std::ptrdiff_t y, std::ptrdiff_t first,
                 std::ptrdiff_t count, std::ptrdiff_t lobe, float* responses) {
  Bands bands;
  const std::ptrdiff_t reach = whole_blocks((3 * lobe + 1) / 4 + 1);
  for (std::ptrdiff_t parity = 0; parity < 2; ++parity) {
    const FilterRows rows(
        integral.corners + y * integral.stride + parity * integral.half + first - kRunMargin,
        integral.stride, lobe);
    make_bands(rows, kRunMargin - reach, kRunMargin + whole_blocks(count) + reach, bands.xx[parity],
               bands.yy[parity], bands.xy[parity]);
  }
  combine_bands(bands, count, lobe, responses);
}

float larger(float a, float b) { return a > b ? a : b; }

float largest_of_rows(const float* middle, std::ptrdiff_t stride) {
  return larger(larger(middle[-stride], middle[stride]), middle[0]);
}

/// The largest response above, below and in each of `count` samples, in all three layers.
void column_maxima(const float* const* layers, std::ptrdiff_t stride, std::ptrdiff_t count,
                   float* __restrict columns) {
  const float* below = layers[0];
  const float* here = layers[1];
  const float* above = layers[2];
  for (std::ptrdiff_t block = 0; block < count; block += kBlock) {
    for (std::ptrdiff_t k = block; k < block + kBlock; ++k) {
      columns[k] = larger(larger(largest_of_rows(below + k, stride),  //
                                 largest_of_rows(above + k, stride)),
                          largest_of_rows(here + k, stride));
    }
  }
}

void maxima_row(const float* const* layers, std::ptrdiff_t stride, std::ptrdiff_t count,
                float min_response, std::uint8_t* __restrict is_maximum) {
  alignas(64) float columns[kHessianRun + 2 * kBlock];
  const float* margin[3];
  for (std::ptrdiff_t begin = 0; begin < count; begin += kHessianRun) {
    const std::ptrdiff_t n = count - begin < kHessianRun ? count - begin : kHessianRun;
    for (std::ptrdiff_t i = 0; i < 3; ++i) margin[i] = layers[i] + begin - kBlock;
    column_maxima(margin, stride, n + 2 * kBlock, columns);
    const float* here = layers[1] + begin;
    const float* column = columns + kBlock;
    for (std::ptrdiff_t block = 0; block < n; block += kBlock) {
      for (std::ptrdiff_t k = block; k < block + kBlock; ++k) {
        const float largest = larger(larger(column[k - 1], column[k + 1]), column[k]);
        is_maximum[begin + k] =
            static_cast<std::uint8_t>((here[k] >= largest) & (here[k] > min_response));
      }
    }
  }
}

/// The mean grey level of each cell of a grid.
void cell_means(const CellGrid& grid, float* __restrict cells) {
  alignas(64) std::uint32_t corners[kCells + 1][kCellStride + 8];
  for (std::size_t i = 0; i <= kCells; ++i) {
    const std::uint32_t* row = grid.rows[i];
    for (std::size_t k = 0; k <= kCellStride; ++k) corners[i][k] = row[grid.columns[k]];
  }
  for (std::size_t i = 0; i < kCells; ++i) {
    const std::uint32_t* upper = corners[i];
    const std::uint32_t* lower = corners[i + 1];
    for (std::size_t k = 0; k < kCellStride; ++k) {
      const std::uint32_t sum = lower[k + 1] - lower[k] - upper[k + 1] + upper[k];
      cells[i * kCellStride + k] =
          static_cast<float>(as_signed(sum)) * (grid.inverse_heights[i] * grid.inverse_widths[k]);
    }
  }
}

/// A bin is 5 samples wide and reaches one further on either side, at falling weight.
constexpr std::size_t kBinWidth = 5;
constexpr std::size_t kBinReach = 7;
constexpr float kBinWeights[kBinReach] = {4.0F / 7, 4.0F / 6, 4.0F / 5, 1.0F,
                                          4.0F / 5, 4.0F / 6, 4.0F / 7};
/// One sample of padding on the left, so that the first bin reaches into it.
constexpr std::size_t kSampleStride = kCellStride;
/// Sums of dx, dy, |dx|, |dy|, a row of each.
using SampleSums = float[4][kSampleStride];

/// Adds one row of samples at `weight`.
void add_samples(const float* upper, const float* lower, float weight, SampleSums& sums) {
  for (std::size_t k = 0; k < kSamples; ++k) {
    const float dx = (upper[k + 1] + lower[k + 1]) - (upper[k] + lower[k]);
    const float dy = (lower[k] + lower[k + 1]) - (upper[k] + upper[k + 1]);
    sums[0][k + 1] += weight * dx;
    sums[1][k + 1] += weight * dy;
    sums[2][k + 1] += weight * __builtin_fabsf(dx);
    sums[3][k + 1] += weight * __builtin_fabsf(dy);
  }
}

/// The 4 bins of a row of samples. All 16 windows are summed, as a vector does that at once.
void add_bins(const float* samples, float* bins) {
  float windows[16] = {};
  for (std::size_t k = 0; k < kBinReach; ++k) {
    for (std::size_t lane = 0; lane < 16; ++lane) {
      windows[lane] += kBinWeights[k] * samples[lane + k];
    }
  }
  for (std::size_t bin = 0; bin < 4; ++bin) bins[bin] = windows[bin * kBinWidth];
}

void quantize(const float* values, std::int8_t* descriptor) {
  float squares[16] = {};
  for (std::size_t i = 0; i < kDescriptorSize; i += 16) {
    for (std::size_t lane = 0; lane < 16; ++lane) {
      squares[lane] += values[i + lane] * values[i + lane];
    }
  }
  float square = 0.0F;
  for (std::size_t lane = 0; lane < 16; ++lane) square += squares[lane];
  const float factor = square > 0.0F ? kDescriptorScale / __builtin_sqrtf(square) : 0.0F;
  for (std::size_t i = 0; i < kDescriptorSize; ++i) {
    float value = values[i] * factor;
    value = value > 127.0F ? 127.0F : (value < -127.0F ? -127.0F : value);
    descriptor[i] =
        static_cast<std::int8_t>(static_cast<std::int32_t>(value + (value < 0.0F ? -0.5F : 0.5F)));
  }
}

void describe(const float* cells, std::int8_t* descriptor) {
  float values[kDescriptorSize];
  for (std::size_t bin_y = 0; bin_y < 4; ++bin_y) {
    SampleSums sums = {};
    for (std::size_t i = 0; i < kBinReach; ++i) {
      const std::size_t y = bin_y * kBinWidth + i;  // one too many, as the first bin reaches -1
      if (y == 0 || y > kSamples) continue;
      add_samples(cells + (y - 1) * kCellStride, cells + y * kCellStride, kBinWeights[i], sums);
    }
    for (std::size_t kind = 0; kind < 4; ++kind) {
      add_bins(sums[kind], values + (bin_y * 4 + kind) * 4);
    }
  }
  quantize(values, descriptor);
}

}  // namespace
}  // namespace loopbit
