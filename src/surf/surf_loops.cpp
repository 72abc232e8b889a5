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

/// A register of any instruction set.
using FourSums = std::uint32_t __attribute__((vector_size(16)));

FourSums load_sums(const std::uint32_t* sums) {
  FourSums four;
  __builtin_memcpy(&four, sums, sizeof four);
  return four;
}

/// Each of four numbers and all before it.
FourSums running(FourSums four) {
  constexpr FourSums kZeros = {};
  four += __builtin_shufflevector(kZeros, four, 0, 4, 5, 6);
  return four + __builtin_shufflevector(kZeros, four, 0, 1, 4, 5);
}

void integral_row(const std::uint8_t* __restrict pixels, std::size_t width,
                  std::uint32_t* __restrict column_sums, std::uint32_t* __restrict even,
                  std::uint32_t* __restrict odd) {
  for (std::size_t x = 0; x < width; ++x) column_sums[x] += pixels[x];
  FourSums before = {};  // the sum of all columns before, four times
  std::size_t i = 0;
  for (; 2 * i + 8 <= width; i += 4) {
    const FourSums first = load_sums(column_sums + 2 * i);
    const FourSums last = load_sums(column_sums + 2 * i + 4);
    const FourSums even_columns = __builtin_shufflevector(first, last, 0, 2, 4, 6);
    const FourSums pairs = even_columns + __builtin_shufflevector(first, last, 1, 3, 5, 7);
    const FourSums after_pairs = before + running(pairs);
    const FourSums at_even = after_pairs - pairs;
    const FourSums at_odd = at_even + even_columns;
    __builtin_memcpy(even + i, &at_even, sizeof at_even);
    __builtin_memcpy(odd + i, &at_odd, sizeof at_odd);
    before = __builtin_shufflevector(after_pairs, after_pairs, 3, 3, 3, 3);
  }
  std::uint32_t sum = before[0];
  for (std::size_t x = 2 * i; x <= width; ++x) {
    (x % 2 == 0 ? even : odd)[x / 2] = sum;
    sum += x < width ? column_sums[x] : 0;
  }
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
    const auto end = static_cast<float>(size);
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(kLines); ++i) {
      // The middle of pixel 0 lies between corners 0 and 1; + 0.5 again rounds.
      constexpr auto kLast = static_cast<std::int32_t>(kPatchCells);
      const float cells = static_cast<float>(i < kLast ? i : kLast) - 10.5F;
      float at = center_px + cells * scale + 1.0F;
      at = at < end ? at : end;
      at = at > 0.0F ? at : 0.0F;
      corners[i] = static_cast<std::int32_t>(at);
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
/// Samples in memory, as cells: rows of 20 in whole vectors of 8, the rest padding.
constexpr std::size_t kSampleStride = kCellStride;
/// A row of samples or bins before the first and one after the last, which are 0.
constexpr std::size_t kSampleRows = kSamples + 2;
/// Rows of bins, for each of which there are 4 kinds of sums: of dx, dy, |dx|, |dy|.
constexpr std::size_t kBinRows = 4;
constexpr std::size_t kSums = kBinRows * 4;

/// A register of any instruction set.
using Four = float __attribute__((vector_size(16)));

template <std::size_t Size>
void clear(float (&values)[Size]) {
  static_assert(Size % 4 == 0);
  constexpr Four kZeros = {};
  for (std::size_t i = 0; i < Size; i += 4) {
    __builtin_memcpy(values + i, &kZeros, sizeof kZeros);
    // A loop that a compiler takes for memset() becomes a slow instruction.
    asm("" : : : "memory");
  }
}

/// Gradients of each row of samples.
struct Samples {
  alignas(64) float dx[kSampleRows][kSampleStride];
  alignas(64) float dy[kSampleRows][kSampleStride];
};

void find_samples(const float* __restrict cells, Samples& samples) {
  clear(samples.dx[0]);
  clear(samples.dy[0]);
  clear(samples.dx[kSampleRows - 1]);
  clear(samples.dy[kSampleRows - 1]);
  for (std::size_t y = 0; y < kSamples; ++y) {
    const float* upper = cells + y * kCellStride;
    const float* lower = upper + kCellStride;
    for (std::size_t k = 0; k < kSampleStride; ++k) {
      samples.dx[y + 1][k] = (upper[k + 1] + lower[k + 1]) - (upper[k] + lower[k]);
      samples.dy[y + 1][k] = (lower[k] + lower[k + 1]) - (upper[k] + upper[k + 1]);
    }
  }
}

/// Sums down the columns of samples for each row of bins.
void add_rows(const Samples& samples, float (&sums)[kSums][kSampleStride]) {
  for (std::size_t bin = 0; bin < kBinRows; ++bin) {
    const float(*dx)[kSampleStride] = samples.dx + bin * kBinWidth;
    const float(*dy)[kSampleStride] = samples.dy + bin * kBinWidth;
    for (std::size_t k = 0; k < kSampleStride; ++k) {
      float sum[4] = {};
#pragma GCC unroll 7
      for (std::size_t i = 0; i < kBinReach; ++i) {
        sum[0] += kBinWeights[i] * dx[i][k];
        sum[1] += kBinWeights[i] * dy[i][k];
        sum[2] += kBinWeights[i] * __builtin_fabsf(dx[i][k]);
        sum[3] += kBinWeights[i] * __builtin_fabsf(dy[i][k]);
      }
      for (std::size_t kind = 0; kind < 4; ++kind) sums[4 * bin + kind][k] = sum[kind];
    }
  }
}

Four load_four(const float* values) {
  Four four;
  __builtin_memcpy(&four, values, sizeof four);
  return four;
}

/// Of 4 x 4 values, each a row of `from` or `to`.
void transpose(const float* from, std::size_t from_stride, float* to, std::size_t to_stride) {
  const Four a = load_four(from);
  const Four b = load_four(from + from_stride);
  const Four c = load_four(from + 2 * from_stride);
  const Four d = load_four(from + 3 * from_stride);
  const Four low_ab = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const Four high_ab = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Four low_cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const Four high_cd = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  const Four rows[4] = {__builtin_shufflevector(low_ab, low_cd, 0, 1, 4, 5),
                        __builtin_shufflevector(low_ab, low_cd, 2, 3, 6, 7),
                        __builtin_shufflevector(high_ab, high_cd, 0, 1, 4, 5),
                        __builtin_shufflevector(high_ab, high_cd, 2, 3, 6, 7)};
  for (std::size_t i = 0; i < 4; ++i)
    __builtin_memcpy(to + i * to_stride, rows + i, sizeof rows[i]);
}

/// Sums along the rows: bin x of sum i is bins[4 i + x].
void add_columns(const float (&sums)[kSums][kSampleStride], float* __restrict bins) {
  alignas(64) float samples[kSampleRows][kSums];
  clear(samples[0]);
  clear(samples[kSampleRows - 1]);
  for (std::size_t k = 0; k < kSamples; k += 4) {
    for (std::size_t i = 0; i < kSums; i += 4) {
      transpose(sums[i] + k, kSampleStride, samples[k + 1] + i, kSums);
    }
  }
  alignas(64) float columns[4][kSums];
  for (std::size_t bin = 0; bin < 4; ++bin) {
    const float(*first)[kSums] = samples + bin * kBinWidth;
    for (std::size_t i = 0; i < kSums; ++i) {
      float sum = 0.0F;
#pragma GCC unroll 7
      for (std::size_t k = 0; k < kBinReach; ++k) sum += kBinWeights[k] * first[k][i];
      columns[bin][i] = sum;
    }
  }
  for (std::size_t i = 0; i < kSums; i += 4) transpose(columns[0] + i, kSums, bins + 4 * i, 4);
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
  Samples samples;
  find_samples(cells, samples);
  alignas(64) float sums[kSums][kSampleStride];
  add_rows(samples, sums);
  float values[kDescriptorSize];
  add_columns(sums, values);
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
