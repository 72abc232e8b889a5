// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/instruction_set.hpp"
#include "loopbit/options.hpp"

namespace loopbit {

/// Side of the saliency map and of the binary content, in pixels.
inline constexpr int kContentSide = 64;

/// The binary content of an image: 64 x 64 bits. Row y is rows[y], column x is its bit x (bit 0 is
/// the left edge), so shifting the image sideways shifts 64 words.
struct BinaryContent {
  alignas(64) std::array<std::uint64_t, kContentSide> rows{};

  bool operator==(const BinaryContent&) const = default;
};

/// |O|: the number of set pixels, 0 to 4096.
[[nodiscard]] int count(const BinaryContent& content);

/// M(O): the mean coordinate of the set pixels, x right and y down, each in [0, 63]. The centre of
/// the map (31.5, 31.5) if none is set.
[[nodiscard]] cv::Point2d center(const BinaryContent& content);

/// The content shifted `columns` to the right (left if negative). Pixels that leave the map are
/// dropped.
[[nodiscard]] BinaryContent shift_columns(const BinaryContent& content, int columns);

/// The content at all shifts of a tolerance of 0 or more columns, from left to right: by even
/// numbers of columns up to the tolerance, and by the tolerance itself, either way. Odd shifts are
/// not needed, because contents are blurred: shifted by one column, a content still has a xi of 0.9
/// with itself.
[[nodiscard]] std::vector<BinaryContent> tolerated_shifts(const BinaryContent& content,
                                                          int tolerance_columns);

/// xi(O1, O2) = |O1 & O2| / max(|O1|, |O2|), in [0, 1]; 0 if either is empty. With a shift
/// tolerance, the maximum over the tolerated shifts of `a`; |O1| is counted before shifting. Wang
/// et al. 2019, section III-B.
[[nodiscard]] double similarity(const BinaryContent& a, const BinaryContent& b,
                                int shift_tolerance_columns = 0);

/// overlaps[i] = the most pixels that places[i] shares with one of `queries`; at least as many
/// overlaps as places. Cost: for each query and place, 512 bytes of AND and bit counts.
void max_overlaps(std::span<const BinaryContent> queries, std::span<const BinaryContent> places,
                  std::span<std::uint16_t> overlaps,
                  InstructionSet instruction_set = active_instruction_set());

struct BinaryContentOptions {
  double gamma = 1.5;
  double blur_sigma_px = 2.5;
  int residual_radius_px = 1;

  static constexpr auto fields() {
    using S = BinaryContentOptions;
    return std::tuple{
        Field{"gamma", &S::gamma, 1.1, 16.0,
              "a pixel is set if its saliency exceeds gamma times the mean; larger sets fewer"},
        Field{"blur_sigma_px", &S::blur_sigma_px, 0.5, 8.0,
              "standard deviation of the Gaussian on the 64 x 64 saliency map, pixels"},
        Field{"residual_radius_px", &S::residual_radius_px, 1, 7,
              "the log amplitude spectrum is averaged over a box of side 2 * radius + 1 pixels"}};
  }
};

/// The spectral residual saliency map S of `gray`, 64 x 64, not normalised.
///
/// `gray`: 8 bits, at least 32 x 32. Hou and Zhang, "Saliency Detection: A Spectral Residual
/// Approach", CVPR 2007, eq. 3 to 6; Wang et al. 2019, section III-A. Values are >= 0, and constant
/// for a flat image. Throws Error (kind input) if `gray` is too small. Cost: see bm_binary_content.
cv::Mat1f saliency_map(const cv::Mat1b& gray, const BinaryContentOptions& options = {});

/// Sets the pixels whose saliency exceeds gamma times the mean. An image without contrast has none.
/// Wang et al. 2019, section III-A. Pixels of `excluded` are not set, and do not count for the
/// mean.
BinaryContent binarize(const cv::Mat1f& saliency, double gamma, const BinaryContent& excluded = {});

/// The pixels of a content of which at least half is excluded by the mask of an image: where
/// `mask`, at least 32 x 32, is 0.
[[nodiscard]] BinaryContent excluded_pixels(const cv::Mat1b& mask);

/// binarize(saliency_map(gray)): step 1 of the method.
BinaryContent binary_content(const cv::Mat1b& gray, const BinaryContentOptions& options = {});

}  // namespace loopbit
