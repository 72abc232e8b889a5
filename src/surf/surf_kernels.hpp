// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "loopbit/descriptor.hpp"
#include "loopbit/instruction_set.hpp"

namespace loopbit {

/// The 8-bit value that stands for 1 in a unit-length descriptor; 127 stands for 0.5 and more.
inline constexpr float kDescriptorScale = 254.0F;
/// A descriptor is made of 20 x 20 samples, each of which spans 2 x 2 of 21 x 21 cells.
inline constexpr std::size_t kSamples = 20;
inline constexpr std::size_t kPatchCells = kSamples + 1;
/// Cells in memory: rows of 21 and padding, and behind the last row as much as a vector may read.
inline constexpr std::size_t kCellStride = 24;
inline constexpr std::size_t kCellsInMemory = kPatchCells * kCellStride + 16;

/// Hessian responses are computed in runs of at most so many samples.
inline constexpr std::ptrdiff_t kHessianRun = 320;

/// An integral image whose rows have the even columns first, then the odd ones: corner (row, 2 i)
/// is corners[row * stride + i], corner (row, 2 i + 1) lies `half` further.
struct IntegralView {
  const std::uint32_t* corners = nullptr;
  std::ptrdiff_t stride = 0;
  std::ptrdiff_t half = 0;
  std::int32_t width = 0;  ///< of the image, in pixels
  std::int32_t height = 0;
};

/// A row to interpolate linearly, between two rows of `width` pixels and their columns; weights are
/// 0 to 256.
struct LinearRow {
  const std::uint8_t* upper = nullptr;
  const std::uint8_t* lower = nullptr;
  std::int32_t lower_weight = 0;
  std::uint32_t width = 0;
  const std::int32_t* columns = nullptr;        ///< the one to the left of each new pixel
  const std::int32_t* right_weights = nullptr;  ///< of the next one; after the last it is that one
};

/// The inner loops of SurfExtractor, for one instruction set.
struct SurfKernels {
  template <InstructionSet>
  static const SurfKernels& compiled_for();

  /// `count` pixels of such a row, rounded. `blended` and `pairs` are room for from.width + 1
  /// numbers.
  void (*linear_row)(const LinearRow& from, std::size_t count, std::uint16_t* blended,
                     std::uint32_t* pairs, std::uint8_t* pixels);
  /// The next row of an integral image. `column_sums`: of all rows before, brought up to date; the
  /// corners at the row's lower edge, width + 1 of them, go to `even` and `odd`, see IntegralView.
  void (*integral_row)(const std::uint8_t* pixels, std::size_t width, std::uint32_t* column_sums,
                       std::uint32_t* even, std::uint32_t* odd);
  /// responses[k] = the determinant of the Hessian (Bay et al. 2008, eq. 3) in squared grey levels,
  /// 0 where negative, at row y and column 2 * (first + k), by box filters with lobes of an odd
  /// width of 3 to 65 px. count <= kHessianRun. Whole blocks of 16 are written, and corners up to
  /// 128 past either end of a row are read, though they decide nothing within the image.
  void (*hessian_row)(const IntegralView& integral, std::ptrdiff_t y, std::ptrdiff_t first,
                      std::ptrdiff_t count, std::ptrdiff_t lobe, float* responses);
  /// is_maximum[k] = 1 where layers[1][k] is above `min_response` and no neighbour in the three
  /// layers, whose rows are `stride` apart, is larger. Reads 16 past either end of the rows at,
  /// before and after layers[i], and writes whole blocks of 16.
  void (*maxima_row)(const float* const* layers, std::ptrdiff_t stride, std::ptrdiff_t count,
                     float min_response, std::uint8_t* is_maximum);
  /// The mean grey levels of kPatchCells x kPatchCells cells around a point, one `scale` in px wide
  /// each; their edges are rounded to pixels and cut off at the image's. `cells` has room for
  /// kCellsInMemory.
  void (*upright_cells)(const IntegralView& integral, float x_px, float y_px, float scale,
                        float* cells);
  /// The SURF descriptor (Bay et al. 2008, section 4.2) of such cells: sums of dx, dy, |dx| and
  /// |dy| over 4 x 4 bins, of unit length, times kDescriptorScale, rounded and cut off at 127. Bin
  /// (x, y) of kind k is value (4 y + k) * 4 + x. All 0 for cells without contrast.
  void (*describe)(const float* cells, std::int8_t* descriptor);
};

}  // namespace loopbit
