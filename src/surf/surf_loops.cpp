// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled once for each instruction set, see loopbit_kernels(): the compiler makes vector code of
// these loops, on x86-64 and on Arm alike. Sums are of integers, or of floats in an order that no
// vector width changes, and a * b + c is never contracted: every set returns the same bits.
#include "surf_kernels.hpp"

namespace loopbit {
namespace {

void linear_row(const LinearRow& from, std::size_t count, std::uint16_t* __restrict blended,
                std::uint32_t* __restrict pairs, std::uint8_t* __restrict pixels) {
  // In units of 1/256 grey level, at most 256 * 255.
  for (std::uint32_t x = 0; x < from.width; ++x) {
    const int lower_part = from.lower_weight * (from.lower[x] - from.upper[x]);
    blended[x] = static_cast<std::uint16_t>(256 * from.upper[x] + lower_part);
  }
  blended[from.width] = blended[from.width - 1];
  for (std::uint32_t x = 0; x < from.width; ++x) {
    pairs[x] = blended[x] | static_cast<std::uint32_t>(blended[x + 1]) << 16U;
  }
  for (std::size_t x = 0; x < count; ++x) {
    const std::uint32_t pair = pairs[from.columns[x]];
    const auto left = static_cast<std::int32_t>(pair & 0xffffU);
    const auto right = static_cast<std::int32_t>(pair >> 16U);
    const std::int32_t sum = 256 * left + from.right_weights[x] * (right - left);
    pixels[x] = static_cast<std::uint8_t>((sum + (1 << 15)) >> 16);
  }
}

/// Row `y` of the integral image from `pixels` and the running sums of each column.
void integral_row(const std::uint8_t* __restrict pixels, std::size_t width,
                  std::uint32_t* __restrict column_sums, std::uint32_t* __restrict even,
                  std::uint32_t* __restrict odd) {
  for (std::size_t x = 0; x < width; ++x) column_sums[x] += pixels[x];
  // Of the sums, only those at even columns wait for each other.
  const std::size_t pairs = width / 2;
  for (std::size_t i = 0; i < pairs; ++i) odd[i] = column_sums[2 * i] + column_sums[2 * i + 1];
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < pairs; ++i) {
    even[i] = sum;
    sum += odd[i];
  }
  even[pairs] = sum;
  for (std::size_t i = 0; i < pairs; ++i) odd[i] = even[i] + column_sums[2 * i];
  if (width % 2 != 0) odd[pairs] = sum + column_sums[width - 1];
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
  const std::uint32_t* columns = band[offset & 1] + kRunMargin + (offset >> 1);
  // A compiler that knows where it points adds that up in the inner loop, for each of ten.
  asm("" : "+r"(columns));
  return columns;
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
      std::int32_t flags[kBlock];  // as wide as what they tell of, so that vectors fit
      for (std::ptrdiff_t i = 0; i < kBlock; ++i) {
        const std::ptrdiff_t k = block + i;
        const float largest = larger(larger(column[k - 1], column[k + 1]), column[k]);
        flags[i] = (here[k] >= largest ? 1 : 0) & (here[k] > min_response ? 1 : 0);
      }
      for (std::ptrdiff_t i = 0; i < kBlock; ++i) {
        is_maximum[begin + block + i] = static_cast<std::uint8_t>(flags[i]);
      }
    }
  }
}

/// Lines between cells along one axis, in pixel corners; those after kPatchCells + 1 repeat the
/// last.
constexpr std::size_t kLines = 32;

struct Lines {
  Lines(float center_px, float scale, std::int32_t size) {
    for (std::size_t i = 0; i < kLines; ++i) {
      // The middle of pixel 0 lies between corners 0 and 1; + 0.5 again rounds.
      const float cells = static_cast<float>(i < kPatchCells ? i : kPatchCells) - 10.5F;
      const float at = center_px + cells * scale + 1.0F;
      const auto end = static_cast<float>(size);
      corners[i] = static_cast<std::int32_t>(at < 0.0F ? 0.0F : (at > end ? end : at));
    }
    for (std::size_t i = 0; i + 1 < kLines; ++i) {
      const std::int32_t length = corners[i + 1] - corners[i];
      inverse_lengths[i] = length > 0 ? 1.0F / static_cast<float>(length) : 0.0F;
    }
  }

  alignas(64) std::int32_t corners[kLines];
  alignas(64) float inverse_lengths[kLines];  ///< of the cells
};

/// The mean grey level of each cell around an upright keypoint.
void upright_cells(const IntegralView& integral, float x_px, float y_px, float scale,
                   float* __restrict cells) {
  const Lines columns(x_px, scale, integral.width);
  const Lines rows(y_px, scale, integral.height);
  alignas(64) std::int32_t offsets[kLines];
  const auto half = static_cast<std::int32_t>(integral.half);
  for (std::size_t k = 0; k < kLines; ++k) {
    offsets[k] = (columns.corners[k] >> 1) + (columns.corners[k] & 1) * half;
  }
  alignas(64) std::uint32_t corners[kPatchCells + 1][kCellStride + 8];
  for (std::size_t i = 0; i <= kPatchCells; ++i) {
    const std::uint32_t* row = integral.corners + rows.corners[i] * integral.stride;
    for (std::size_t k = 0; k <= kCellStride; ++k) corners[i][k] = row[offsets[k]];
  }
  for (std::size_t i = 0; i < kPatchCells; ++i) {
    const std::uint32_t* upper = corners[i];
    const std::uint32_t* lower = corners[i + 1];
    for (std::size_t k = 0; k < kCellStride; ++k) {
      const std::uint32_t sum = lower[k + 1] - lower[k] - upper[k + 1] + upper[k];
      cells[i * kCellStride + k] = static_cast<float>(as_signed(sum)) *
                                   (rows.inverse_lengths[i] * columns.inverse_lengths[k]);
    }
  }
}

/// A bin is 5 samples wide and reaches one further on either side, at falling weight.
constexpr std::size_t kBinWidth = 5;
constexpr std::size_t kBinReach = 7;
constexpr float kBinWeights[kBinReach] = {4.0F / 7, 4.0F / 6, 4.0F / 5, 1.0F,
                                          4.0F / 5, 4.0F / 6, 4.0F / 7};
/// Samples in memory: rows of 20 in whole vectors, the rest padding.
constexpr std::size_t kSampleStride = 32;
/// Sums of dx, dy, |dx|, |dy|, a row of each.
using SampleSums = float[4][kSampleStride];

/// Adds one row of samples at `weight`.
void add_samples(const float* __restrict upper, const float* __restrict lower, float weight,
                 SampleSums& sums) {
  for (std::size_t k = 0; k < kSampleStride; ++k) {
    const float dx = (upper[k + 1] + lower[k + 1]) - (upper[k] + lower[k]);
    const float dy = (lower[k] + lower[k + 1]) - (upper[k] + upper[k + 1]);
    sums[0][k] += weight * dx;
    sums[1][k] += weight * dy;
    sums[2][k] += weight * __builtin_fabsf(dx);
    sums[3][k] += weight * __builtin_fabsf(dy);
  }
}

/// One value of each kind: a register of any instruction set, which compilers leave as it is.
using Kinds = float __attribute__((vector_size(16)));

/// The 4 bins of each kind in a row of samples: bin x of kind k is bins[4 k + x].
void add_bins(const SampleSums& sums, float* __restrict bins) {
  // After a sample of padding, into which the first bin reaches.
  alignas(Kinds) float samples[kSamples + 2][4] = {};
  for (std::size_t k = 0; k < kSamples; ++k) {
    for (std::size_t kind = 0; kind < 4; ++kind) samples[k + 1][kind] = sums[kind][k];
  }
  alignas(Kinds) float columns[4][4];
  for (std::size_t bin = 0; bin < 4; ++bin) {
    Kinds sum = {};
    for (std::size_t k = 0; k < kBinReach; ++k) {
      Kinds sample;
      __builtin_memcpy(&sample, samples[bin * kBinWidth + k], sizeof sample);
      sum += kBinWeights[k] * sample;
    }
    __builtin_memcpy(columns[bin], &sum, sizeof sum);
  }
  for (std::size_t kind = 0; kind < 4; ++kind) {
    for (std::size_t bin = 0; bin < 4; ++bin) bins[4 * kind + bin] = columns[bin][kind];
  }
}

void quantize(const float* values, std::int8_t* descriptor) {
  float squares[16] = {};
  for (std::size_t i = 0; i < kDescriptorSize; i += 16) {
    for (std::size_t lane = 0; lane < 16; ++lane) {
      squares[lane] += values[i + lane] * values[i + lane];
    }
  }
  float square = 0.0F;
  for (const float part : squares) square += part;
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
    add_bins(sums, values + bin_y * 16);
  }
  quantize(values, descriptor);
}

constexpr SurfKernels kSurfKernels{linear_row, integral_row,  hessian_row,
                                   maxima_row, upright_cells, describe};

}  // namespace

template <InstructionSet>
const SurfKernels& SurfKernels::compiled_for() {
  return kSurfKernels;
}
template const SurfKernels& SurfKernels::compiled_for<InstructionSet::LOOPBIT_INSTRUCTION_SET>();

}  // namespace loopbit
