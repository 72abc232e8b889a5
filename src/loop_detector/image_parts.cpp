// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "image_parts.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>

namespace loopbit {
namespace {

/// Gaps of up to twice as many content pixels belong to a part.
constexpr int kHalfGap_px = 3;

/// In which of `number` equal parts of a side a keypoint lies.
int part_of(float px, int side_px, int number) {
  const float part = px * static_cast<float>(number) / static_cast<float>(side_px);
  return static_cast<int>(std::clamp(part, 0.0F, static_cast<float>(number - 1)));
}

std::uint64_t column_bit(const cv::Point& pixel) {
  return std::uint64_t{1} << static_cast<unsigned>(pixel.x);
}

BinaryContent inverted(const BinaryContent& content) {
  BinaryContent result;
  std::ranges::transform(content.rows, result.rows.begin(), std::bit_not{});
  return result;
}

}  // namespace

cv::Point content_pixel(const Keypoint& keypoint, const cv::Size& size_px) {
  return {part_of(keypoint.x_px, size_px.width, kContentSide),
          part_of(keypoint.y_px, size_px.height, kContentSide)};
}

bool is_set(const BinaryContent& content, const cv::Point& pixel) {
  return (content.rows[static_cast<std::size_t>(pixel.y)] & column_bit(pixel)) != 0;
}

void set(BinaryContent& content, const cv::Point& pixel) {
  content.rows[static_cast<std::size_t>(pixel.y)] |= column_bit(pixel);
}

void clear(BinaryContent& content, const BinaryContent& pixels) {
  for (std::size_t y = 0; y < content.rows.size(); ++y) content.rows[y] &= ~pixels.rows[y];
}

BinaryContent dilated(const BinaryContent& content, int reach) {
  BinaryContent result = content;
  for (int i = 0; i < reach; ++i) {
    BinaryContent wide;
    for (std::size_t y = 0; y < result.rows.size(); ++y) {
      const std::uint64_t row = result.rows[y];
      const std::uint64_t wide_row = row | row << 1U | row >> 1U;
      wide.rows[y] |= wide_row;
      if (y > 0) wide.rows[y - 1] |= wide_row;
      if (y + 1 < result.rows.size()) wide.rows[y + 1] |= wide_row;
    }
    result = wide;
  }
  return result;
}

BinaryContent closed(const BinaryContent& content) {
  return inverted(dilated(inverted(dilated(content, kHalfGap_px)), kHalfGap_px));
}

std::size_t cell_of(const Keypoint& keypoint, const cv::Size& size_px, int columns, int rows) {
  const int row = part_of(keypoint.y_px, size_px.height, rows);
  const int index = row * columns + part_of(keypoint.x_px, size_px.width, columns);
  return static_cast<std::size_t>(index);
}

bool is_lesser_part(const std::vector<Keypoint>& part, const Features& image) {
  const auto num_cells = [&](const std::vector<Keypoint>& keypoints) {
    PerCell<bool> has_any{};
    for (const Keypoint& keypoint : keypoints) {
      has_any.at(cell_of(keypoint, image.working_size_px)) = true;
    }
    return std::ranges::count(has_any, true);
  };
  return 2 * num_cells(part) < num_cells(image.keypoints);
}

}  // namespace loopbit
