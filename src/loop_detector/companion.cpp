// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "companion.hpp"

#include "image_parts.hpp"

namespace loopbit {
namespace {

/// A descriptor reaches 10 scales beyond its middle: 20 px of 640, or two content pixels, at the
/// smallest scales. So far beside a companion, features still show some of it.
constexpr int kEdge_px = 2;

}  // namespace

BinaryContent companion_pixels(const Features& image, const std::vector<Keypoint>& shared) {
  if (!is_lesser_part(shared, image)) return {};
  BinaryContent pixels;
  for (const Keypoint& keypoint : shared) {
    set(pixels, content_pixel(keypoint, image.working_size_px));
  }
  return dilated(closed(pixels), kEdge_px);
}

}  // namespace loopbit
