// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "similarity_matrix.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "loopbit/kernels.hpp"

namespace loopbit::report {
namespace {

constexpr int kMaxSide = 640;
constexpr int kMaxFrames = 2048;

int divided_up(int whole, int parts) { return (whole + parts - 1) / parts; }

}  // namespace

SimilarityMatrix similarity_matrix(const std::vector<BinaryContent>& contents,
                                   int shift_tolerance_columns) {
  const int frames = static_cast<int>(contents.size());
  const int step = std::max(1, divided_up(frames, kMaxFrames));
  SimilarityMatrix matrix;
  matrix.frames_per_cell = std::max(1, divided_up(frames, kMaxSide));
  const int side = divided_up(frames, matrix.frames_per_cell);
  matrix.cells = cv::Mat1b(side, side, std::uint8_t{0});

  std::vector<BinaryContent> compared;
  compared.reserve(static_cast<std::size_t>(divided_up(frames, step)));
  for (int frame = 0; frame < frames; frame += step) {
    compared.push_back(contents[static_cast<std::size_t>(frame)]);
  }
  std::vector<int> counts;
  counts.reserve(compared.size());
  for (const BinaryContent& content : compared) counts.push_back(count(content));

  std::vector<std::uint16_t> overlaps(compared.size());
  for (std::size_t later = 1; later < compared.size(); ++later) {
    const std::vector<BinaryContent> shifted =
        tolerated_shifts(compared[later], shift_tolerance_columns);
    active_kernels().max_overlaps(shifted.front().rows.data(), shifted.size(),
                                  compared.front().rows.data(), later, overlaps.data());
    const int row = static_cast<int>(later) * step / matrix.frames_per_cell;
    for (std::size_t earlier = 0; earlier < later; ++earlier) {
      const int larger = std::max({counts[later], counts[earlier], 1});
      const auto level = static_cast<std::uint8_t>(std::lround(255.0 * overlaps[earlier] / larger));
      std::uint8_t& cell =
          matrix.cells(row, static_cast<int>(earlier) * step / matrix.frames_per_cell);
      cell = std::max(cell, level);
    }
  }
  return matrix;
}

}  // namespace loopbit::report
