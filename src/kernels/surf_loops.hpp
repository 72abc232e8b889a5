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

/// Responses are computed in runs this long, whose partial sums stay in the level 1 cache.
constexpr std::ptrdiff_t kRun = 128;

/// Corner columns at an offset from those of each sample, in one row.
class CornerRow {
 public:
  CornerRow(const IntegralView& integral, std::ptrdiff_t row, std::ptrdiff_t first)
      : even_(integral.corners + row * integral.stride + first), half_(integral.half) {}

  [[nodiscard]] const std::uint32_t* at(std::ptrdiff_t offset) const {
    return even_ + (offset & 1) * half_ + (offset >> 1);
  }

 private:
  const std::uint32_t* even_;
  std::ptrdiff_t half_;
};

std::int32_t as_signed(std::uint32_t value) { return static_cast<std::int32_t>(value); }

/// out[k] = sum over the two columns of (outer rows' box - 3 * inner rows' box).
void second_derivative_y(const IntegralView& integral, std::ptrdiff_t y, std::ptrdiff_t first,
                         std::ptrdiff_t lobe, std::ptrdiff_t n, std::int32_t* out) {
  const CornerRow outer0(integral, y - (3 * lobe - 1) / 2, first);
  const CornerRow inner0(integral, y - (lobe - 1) / 2, first);
  const CornerRow inner1(integral, y + (lobe + 1) / 2, first);
  const CornerRow outer1(integral, y + (3 * lobe + 1) / 2, first);
  const std::uint32_t* a0 = outer0.at(1 - lobe);
  const std::uint32_t* a1 = outer0.at(lobe);
  const std::uint32_t* b0 = inner0.at(1 - lobe);
  const std::uint32_t* b1 = inner0.at(lobe);
  const std::uint32_t* c0 = inner1.at(1 - lobe);
  const std::uint32_t* c1 = inner1.at(lobe);
  const std::uint32_t* d0 = outer1.at(1 - lobe);
  const std::uint32_t* d1 = outer1.at(lobe);
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    const std::uint32_t outer = d1[k] - d0[k] - a1[k] + a0[k];
    const std::uint32_t inner = c1[k] - c0[k] - b1[k] + b0[k];
    out[k] = as_signed(outer - 3 * inner);
  }
}

void second_derivative_x(const IntegralView& integral, std::ptrdiff_t y, std::ptrdiff_t first,
                         std::ptrdiff_t lobe, std::ptrdiff_t n, std::int32_t* out) {
  const CornerRow top(integral, y - lobe + 1, first);
  const CornerRow bottom(integral, y + lobe, first);
  const std::ptrdiff_t outer0 = -(3 * lobe - 1) / 2;
  const std::ptrdiff_t inner0 = -(lobe - 1) / 2;
  const std::uint32_t* a0 = top.at(outer0);
  const std::uint32_t* a1 = bottom.at(outer0);
  const std::uint32_t* b0 = top.at(inner0);
  const std::uint32_t* b1 = bottom.at(inner0);
  const std::uint32_t* c0 = top.at(inner0 + lobe);
  const std::uint32_t* c1 = bottom.at(inner0 + lobe);
  const std::uint32_t* d0 = top.at(outer0 + 3 * lobe);
  const std::uint32_t* d1 = bottom.at(outer0 + 3 * lobe);
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    const std::uint32_t outer = d1[k] - d0[k] - a1[k] + a0[k];
    const std::uint32_t inner = c1[k] - c0[k] - b1[k] + b0[k];
    out[k] = as_signed(outer - 3 * inner);
  }
}

/// For the columns that are `first`, and so on, of one side: upper band minus lower band.
void bands(const IntegralView& integral, std::ptrdiff_t y, std::ptrdiff_t first,
           std::ptrdiff_t lobe, std::ptrdiff_t offset, std::ptrdiff_t n, std::uint32_t* out) {
  const std::uint32_t* a = CornerRow(integral, y - lobe, first).at(offset);
  const std::uint32_t* b = CornerRow(integral, y, first).at(offset);
  const std::uint32_t* c = CornerRow(integral, y + 1, first).at(offset);
  const std::uint32_t* d = CornerRow(integral, y + lobe + 1, first).at(offset);
  for (std::ptrdiff_t k = 0; k < n; ++k) out[k] = b[k] - a[k] - d[k] + c[k];
}

void second_derivative_xy(const IntegralView& integral, std::ptrdiff_t y, std::ptrdiff_t first,
                          std::ptrdiff_t lobe, std::ptrdiff_t n, std::int32_t* out) {
  std::uint32_t left0[kRun];
  std::uint32_t left1[kRun];
  std::uint32_t right0[kRun];
  std::uint32_t right1[kRun];
  bands(integral, y, first, lobe, -lobe, n, left0);
  bands(integral, y, first, lobe, 0, n, left1);
  bands(integral, y, first, lobe, 1, n, right0);
  bands(integral, y, first, lobe, lobe + 1, n, right1);
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    out[k] = as_signed(left1[k] - left0[k] - right1[k] + right0[k]);
  }
}

/// Bay et al. 2008, eq. 3, with lobes counted as there; 0 where it is negative.
void hessian_row(const IntegralView& integral, std::ptrdiff_t y, std::ptrdiff_t first,
                 std::ptrdiff_t count, std::ptrdiff_t lobe, float* responses) {
  const float norm = 1.0F / static_cast<float>(9 * lobe * lobe);
  std::int32_t xx[kRun];
  std::int32_t yy[kRun];
  std::int32_t xy[kRun];
  for (std::ptrdiff_t begin = 0; begin < count; begin += kRun) {
    const std::ptrdiff_t n = count - begin < kRun ? count - begin : kRun;
    second_derivative_x(integral, y, first + begin, lobe, n, xx);
    second_derivative_y(integral, y, first + begin, lobe, n, yy);
    second_derivative_xy(integral, y, first + begin, lobe, n, xy);
    for (std::ptrdiff_t k = 0; k < n; ++k) {
      const float dxx = static_cast<float>(xx[k]) * norm;
      const float dyy = static_cast<float>(yy[k]) * norm;
      const float dxy = static_cast<float>(xy[k]) * norm;
      const float determinant = dxx * dyy - 0.81F * (dxy * dxy);
      responses[begin + k] = determinant > 0.0F ? determinant : 0.0F;
    }
  }
}

float larger(float a, float b) { return a > b ? a : b; }

/// is_maximum[k] of `count` responses, whose 26 neighbours are all there to be read.
void maxima_row(const float* const* layers, std::ptrdiff_t stride, std::ptrdiff_t count,
                float min_response, std::uint8_t* is_maximum) {
  for (std::ptrdiff_t k = 0; k < count; ++k) {
    const float* below = layers[0] + k;
    const float* here = layers[1] + k;
    const float* above = layers[2] + k;
    float before = min_response;
    float after = 0.0F;
    for (std::ptrdiff_t dy = -1; dy <= 1; ++dy) {
      for (std::ptrdiff_t dx = -1; dx <= 1; ++dx) {
        before = larger(before, below[dy * stride + dx]);
        after = larger(after, above[dy * stride + dx]);
      }
      before = larger(before, here[-stride + dy]);
      after = larger(after, here[stride + dy]);
    }
    before = larger(before, here[-1]);
    after = larger(after, here[1]);
    is_maximum[k] = here[0] > before && here[0] >= after ? 1 : 0;
  }
}

/// The mean grey level of each cell of a grid: rows[i] and columns[k] are its corner lines.
void cell_means(const CellGrid& grid, float* cells) {
  std::uint32_t last[kCellStride];
  std::uint32_t sums[kCellStride];
  std::uint32_t corners[kCellStride + 1];
  for (std::size_t i = 0; i <= kCells; ++i) {
    const std::uint32_t* row = grid.rows[i];
    for (std::size_t k = 0; k < kCellStride; ++k) corners[k] = row[grid.columns[k]];
    corners[kCellStride] = 0;
    for (std::size_t k = 0; k < kCellStride; ++k) sums[k] = corners[k + 1] - corners[k];
    if (i > 0) {
      float* means = cells + (i - 1) * kCellStride;
      const float height = grid.inverse_heights[i - 1];
      for (std::size_t k = 0; k < kCellStride; ++k) {
        means[k] =
            static_cast<float>(as_signed(sums[k] - last[k])) * (height * grid.inverse_widths[k]);
      }
    }
    for (std::size_t k = 0; k < kCellStride; ++k) last[k] = sums[k];
  }
}

/// A bin is 5 samples wide and reaches one further on either side, at falling weight.
constexpr std::size_t kBinWidth = 5;
constexpr std::size_t kBinReach = 7;
constexpr float kBinWeights[kBinReach] = {4.0F / 7, 4.0F / 6, 4.0F / 5, 1.0F,
                                          4.0F / 5, 4.0F / 6, 4.0F / 7};
/// One sample of padding on the left, so that the first bin reaches into it.
constexpr std::size_t kSampleStride = kCellStride + 1;

/// Adds one row of samples at `weight`: sums of dx, |dx|, dy, |dy|, a row of each.
void add_samples(const float* upper, const float* lower, float weight,
                 float (*sums)[kSampleStride]) {
  for (std::size_t k = 0; k < kSamples; ++k) {
    const float dx = (upper[k + 1] + lower[k + 1]) - (upper[k] + lower[k]);
    const float dy = (lower[k] + lower[k + 1]) - (upper[k] + upper[k + 1]);
    sums[0][k + 1] += weight * dx;
    sums[1][k + 1] += weight * dy;
    sums[2][k + 1] += weight * __builtin_fabsf(dx);
    sums[3][k + 1] += weight * __builtin_fabsf(dy);
  }
}

void describe(const float* cells, std::int8_t* descriptor) {
  float values[kDescriptorSize];
  for (std::size_t bin_y = 0; bin_y < 4; ++bin_y) {
    float sums[4][kSampleStride] = {};
    for (std::size_t i = 0; i < kBinReach; ++i) {
      const std::size_t y = bin_y * kBinWidth + i;  // one too many, as the first bin reaches -1
      if (y == 0 || y > kSamples) continue;
      add_samples(cells + (y - 1) * kCellStride, cells + y * kCellStride, kBinWeights[i], sums);
    }
    for (std::size_t kind = 0; kind < 4; ++kind) {
      for (std::size_t bin_x = 0; bin_x < 4; ++bin_x) {
        float value = 0.0F;
        for (std::size_t k = 0; k < kBinReach; ++k) {
          value += kBinWeights[k] * sums[kind][bin_x * kBinWidth + k];
        }
        values[(bin_y * 4 + kind) * 4 + bin_x] = value;
      }
    }
  }
  float squares[16] = {};
  for (std::size_t i = 0; i < kDescriptorSize; ++i) squares[i % 16] += values[i] * values[i];
  float square = 0.0F;
  for (const float part : squares) square += part;
  const float factor = square > 0.0F ? kDescriptorScale / __builtin_sqrtf(square) : 0.0F;
  for (std::size_t i = 0; i < kDescriptorSize; ++i) {
    float value = values[i] * factor;
    value = value > 127.0F ? 127.0F : (value < -127.0F ? -127.0F : value);
    descriptor[i] = static_cast<std::int8_t>(
        static_cast<std::int32_t>(value + (value < 0.0F ? -0.5F : 0.5F)));
  }
}

}  // namespace
}  // namespace loopbit
