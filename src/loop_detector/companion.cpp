// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "companion.hpp"

#include <algorithm>

#include "image_parts.hpp"

namespace loopbit {
namespace {

/// A descriptor reaches 10 scales beyond its middle: 20 px of 640, or two content pixels, at the
/// smallest scales. So far beside a companion, features still show some of it.
constexpr int kEdge_px = 2;

}  // namespace

BinaryContent companion_pixels(const Features& image, const std::vector<Keypoint>& shared) {
  const cv::Size& size_px = image.working_size_px;
  PerCell<bool> has_features{};
  PerCell<bool> has_shared{};
  BinaryContent pixels;
  for (const Keypoint& keypoint : image.keypoints)
    has_features.at(cell_of(keypoint, size_px)) = true;
  for (const Keypoint& keypoint : shared) {
    has_shared.at(cell_of(keypoint, size_px)) = true;
    set(pixels, content_pixel(keypoint, size_px));
  }
  const auto num_shared = std::ranges::count(has_shared, true);
  if (2 * num_shared >= std::ranges::count(has_features, true)) return {};
  return dilated(closed(pixels), kEdge_px);
}

}  // namespace loopbit
