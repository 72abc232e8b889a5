// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/binary_content.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

/// The pixel of a content that shows a keypoint of an image of `size_px`.
cv::Point content_pixel(const Keypoint& keypoint, const cv::Size& size_px);

bool is_set(const BinaryContent& content, const cv::Point& pixel);
void set(BinaryContent& content, const cv::Point& pixel);
void clear(BinaryContent& content, const BinaryContent& pixels);

/// With all pixels at most `reach` rows and columns away.
BinaryContent dilated(const BinaryContent& content, int reach);

/// With the gaps between its pixels that are part of one thing: up to a tenth of the image.
BinaryContent closed(const BinaryContent& content);

/// An image in 4 x 4 cells.
inline constexpr int kCellsPerSide = 4;
template <typename Value>
using PerCell = std::array<Value, std::size_t{kCellsPerSide} * kCellsPerSide>;
/// The number of the cell, row by row.
std::size_t cell_of(const Keypoint& keypoint, const cv::Size& size_px, int columns = kCellsPerSide,
                    int rows = kCellsPerSide);

/// Whether keypoints of an image lie in less than half of the cells that have features.
bool is_lesser_part(const std::vector<Keypoint>& part, const Features& image);

/// Removes the features whose keypoint `is_unwanted`.
template <typename IsUnwanted>
void remove_features(Features& features, const IsUnwanted& is_unwanted) {
  std::size_t kept = 0;
  std::size_t kept_dark = 0;
  for (std::size_t i = 0; i < features.keypoints.size(); ++i) {
    if (is_unwanted(features.keypoints[i])) continue;
    if (i < features.num_dark) ++kept_dark;
    features.keypoints[kept] = features.keypoints[i];
    features.descriptors[kept] = features.descriptors[i];
    ++kept;
  }
  features.num_dark = kept_dark;
  features.keypoints.resize(kept);
  features.descriptors.resize(kept);
}

}  // namespace loopbit
