// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace loopbit {

/// 64-bit words in one binary content.
inline constexpr std::size_t kContentWords = 64;
/// Block counts in [0, 16] in one record, which packs them in 4 bits, where 15 stands for 16: its
/// byte 32 p + k has count 64 p + k in the lower bits, and count 64 p + 32 + k in the upper ones.
inline constexpr std::size_t kBlockCounts = 256;
inline constexpr std::size_t kPackedBytes = kBlockCounts / 2;
inline constexpr std::size_t kPackedRun = 32;
/// 8-bit counts in one record of coarse counts, and records that lie interleaved: the first four
/// counts of each record, then the next four of each, and so on.
inline constexpr std::size_t kCoarseCounts = 64;
inline constexpr std::size_t kInterleaved = 16;
inline constexpr std::size_t kCountsAtOnce = 4;
/// What several queries reach with one record.
struct Reached {
  std::uint16_t largest_sum;
  std::uint16_t queries;  ///< a bit for each that has the least sum that is needed
};

/// Which records to select: those whose largest sum is at least `lower` and below `upper`, both at
/// most 32,767, and that some query reaches. A query reaches record i if its sum is at least
/// max(query_count, smallest_counts[i]) * floor / 65,536, rounded down.
struct Selection {
  std::uint16_t lower = 0;
  std::uint16_t upper = 0;
  std::uint16_t query_count = 0;
  std::uint16_t floor = 0;
  const std::uint16_t* smallest_counts = nullptr;
};
struct Selected {
  std::uint16_t record;
  std::uint16_t queries;  ///< a bit for each that reaches it
};

/// 8-bit values in one descriptor, from -127 to 127.
inline constexpr std::size_t kDescriptorSize = 64;

/// What one 8-bit descriptor value counts: a unit-length descriptor has the length 254.
inline constexpr float kDescriptorScale = 254.0F;
/// A descriptor is made of 20 x 20 samples, each of which spans 2 x 2 of 21 x 21 cells.
inline constexpr std::size_t kSamples = 20;
inline constexpr std::size_t kCells = kSamples + 1;
/// Cells in memory: rows of 21 and padding, and behind the last row as much as a vector may read.
inline constexpr std::size_t kCellStride = 24;
inline constexpr std::size_t kCellsInMemory = kCells * kCellStride + 16;

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

/// Descriptors whose neighbours are sought at once.
inline constexpr std::size_t kMatchLanes = 16;

/// The neighbours of kMatchLanes descriptors by squared distance; of equals, the first is nearest.
struct NearestTwo {
  static constexpr std::int32_t kNone = 0x7fffffff;

  alignas(64) std::int32_t index[kMatchLanes];
  alignas(64) std::int32_t distance_sq[kMatchLanes];         ///< kNone if there is no other
  alignas(64) std::int32_t second_distance_sq[kMatchLanes];  ///< kNone if there is only one
};

/// Pairs in a minimal sample for a fundamental matrix, and samples that are solved at once.
inline constexpr std::size_t kSamplePairs = 7;
inline constexpr std::size_t kSampleLanes = 8;

/// The points (x0, y0) of one image and (x1, y1) of the other, one column a sample.
struct PairSamples {
  alignas(64) float x0[kSamplePairs][kSampleLanes];
  alignas(64) float y0[kSamplePairs][kSampleLanes];
  alignas(64) float x1[kSamplePairs][kSampleLanes];
  alignas(64) float y1[kSamplePairs][kSampleLanes];
};

/// All matrices f + x g that fulfil the epipolar constraint of a sample's pairs, row by row, and
/// the coefficients of det(f + x g) by rising powers of x. One column a sample.
struct EpipolarPencils {
  alignas(64) double f[9][kSampleLanes];
  alignas(64) double g[9][kSampleLanes];
  alignas(64) double determinant[4][kSampleLanes];
  std::uint8_t is_determined[kSampleLanes];  ///< 0 where the pairs allow more matrices than these
};

/// Pairs of points in blocks: behind the last one there is room for a whole block.
inline constexpr std::size_t kPairBlock = 16;
struct PointPairs {
  const float* x0 = nullptr;
  const float* y0 = nullptr;
  const float* x1 = nullptr;
  const float* y1 = nullptr;
  std::size_t count = 0;
};

/// How well one fundamental matrix explains pairs: the sum of min(error^2, largest error^2), and
/// how many pairs have less than the largest error.
struct EpipolarScore {
  float cost = 0;
  std::int32_t inliers = 0;
};

/// The inner loops that decide the speed of loopbit, for one instruction set. All of them return
/// the same bits: sums are of integers, or of floats in one fixed order without contraction. The
/// scalar one is the reference; on Arm the compiler makes NEON code of it, and once more with the
/// dot product extension.
struct Kernels {
  std::string_view name;

  /// overlaps[i] = max over q of |queries[q] & places[i]|, each content 64 words.
  /// Cost: num_queries * num_places * 512 bytes of AND and popcount.
  void (*max_overlaps)(const std::uint64_t* queries, std::size_t num_queries,
                       const std::uint64_t* places, std::size_t num_places,
                       std::uint16_t* overlaps);

  /// Which queries reach what a record needs; each query has its 256 block counts in bytes, in
  /// order, each record packs them. Of the queries q < 16 whose bit is set in among[i / 2], bit q
  /// of reached[i].queries is set where the sum over k of min(count k of q, count k of record i) is
  /// at least least[i]; reached[i].largest_sum is the largest of these sums.
  /// Cost: for each of these queries and each two records, 512 bytes of minimum and sum.
  void (*reaching_queries)(const std::uint8_t* queries, const std::uint16_t* among,
                           const std::uint8_t* const* records, std::size_t num_records,
                           const std::uint16_t* least, Reached* reached);

  /// All such sums of coarse counts in [0, 64]: each query has its 64 in order, the records come in
  /// groups of 16 interleaved ones. sums[(g * num_queries + q) * 16 + i] belongs to query q and
  /// record i of group g, and largest[g] is the largest of group g.
  /// Cost: num_queries * num_groups * 1 KB of minimum and sum, less where no query has a count.
  void (*coarse_sums)(const std::uint8_t* queries, std::size_t num_queries,
                      const std::uint8_t* groups, std::size_t num_groups, std::uint16_t* sums,
                      std::uint16_t* largest);

  /// The records, in order, that such sums of at most 16 queries and 4,096 groups leave; returns
  /// how many there are. `selected` has room for all.
  std::size_t (*select_records)(const std::uint16_t* sums, const std::uint16_t* largest,
                                std::size_t num_queries, std::size_t num_groups,
                                const Selection& selection, Selected* selected);

  /// constants[i] = what this variant's nearest_two has to know of the i-th descriptor.
  void (*describe_constants)(const std::int8_t* descriptors, std::size_t num_descriptors,
                             std::int32_t* constants);

  /// The nearest and second nearest of `others` for each of 16 descriptors. `constants` belong to
  /// `others`. Cost: 16 * num_others products of 64 values.
  void (*nearest_two)(const std::int8_t* descriptors, const std::int8_t* others,
                      const std::int32_t* constants, std::size_t num_others, NearestTwo& nearest);

  /// sums[x] += weight * pixels[x], for weights up to 257.
  void (*add_pixels)(const std::uint8_t* pixels, std::size_t width, std::uint16_t weight,
                     std::uint32_t* sums);
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
  /// The mean grey levels of kCells x kCells cells around a point, one `scale` in px wide each;
  /// their edges are rounded to pixels and cut off at the image's. `cells` has room for
  /// kCellsInMemory.
  void (*upright_cells)(const IntegralView& integral, float x_px, float y_px, float scale,
                        float* cells);
  /// The SURF descriptor (Bay et al. 2008, section 4.2) of such cells: sums of dx, dy, |dx| and
  /// |dy| over 4 x 4 bins, of unit length, times kDescriptorScale, rounded and cut off at 127. Bin
  /// (x, y) of kind k is value (4 y + k) * 4 + x. All 0 for cells without contrast.
  void (*describe)(const float* cells, std::int8_t* descriptor);

  /// The seven-point method (Hartley and Zisserman 2004, section 11.1.2) up to its cubic equation.
  /// Points are to be of the order of 1.
  void (*solve_samples)(const PairSamples& samples, EpipolarPencils& pencils);
  /// Scores a model of 9 elements, row by row, by the square of Sampson's distance (ibid., section
  /// 11.4.3). is_inlier[i] is 1 for inliers, else 0; whole blocks of it are written.
  EpipolarScore (*epipolar_score)(const float* model, const PointPairs& pairs, float max_error_sq,
                                  std::uint8_t* is_inlier);
};

/// The kernels this processor can run, slowest first: "scalar", then on x86-64 "avx2" and "avx512",
/// on Arm "dotprod".
std::span<const Kernels* const> available_kernels();

/// The fastest of them, or the one that the environment variable LOOPBIT_KERNEL names (unless
/// empty) when it is first called. Throws Error (kind option) if that one is unknown or cannot run
/// here.
const Kernels& active_kernels();

}  // namespace loopbit
