// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "similarity_matrix.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

namespace loopbit::report {
namespace {

constexpr int kMaxSide = 640;
constexpr int kMaxFrames = 2048;

int divided_up(int whole, int parts) { return (whole + parts - 1) / parts; }

/// Quantises a xi for the matrix.
std::uint8_t level(double similarity) {
  return static_cast<std::uint8_t>(std::lround(255.0 * similarity));
}

/// Raises the cell of two frames to their xi.
void raise(SimilarityMatrix& matrix, int later, int earlier, std::uint8_t level) {
  std::uint8_t& cell =
      matrix.cells(later / matrix.frames_per_cell, earlier / matrix.frames_per_cell);
  cell = std::max(cell, level);
}

/// Compares every `matrix.compared_every`-th frame with all earlier such frames.
void compare_evenly(SimilarityMatrix& matrix, const std::vector<BinaryContent>& contents,
                    int shift_tolerance_columns) {
  const int step = matrix.compared_every;
  const int frames = static_cast<int>(contents.size());
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
    max_overlaps(shifted, std::span(compared).first(later), overlaps);
    for (std::size_t earlier = 0; earlier < later; ++earlier) {
      const double larger = std::max({counts[later], counts[earlier], 1});
      raise(matrix, static_cast<int>(later) * step, static_cast<int>(earlier) * step,
            level(overlaps[earlier] / larger));
    }
  }
}

}  // namespace

SimilarityMatrix similarity_matrix(const std::vector<BinaryContent>& contents,
                                   const std::vector<ReportedMatch>& matches,
                                   int shift_tolerance_columns) {
  const int frames = static_cast<int>(contents.size());
  SimilarityMatrix matrix;
  matrix.compared_every = std::max(1, divided_up(frames, kMaxFrames));
  matrix.frames_per_cell = std::max(1, divided_up(frames, kMaxSide));
  const int side = divided_up(frames, matrix.frames_per_cell);
  matrix.cells = cv::Mat1b(side, side, std::uint8_t{0});
  compare_evenly(matrix, contents, shift_tolerance_columns);
  for (const ReportedMatch& match : matches) {
    if (match.query >= frames || match.match >= match.query) continue;
    raise(matrix, match.query, match.match,
          level(similarity(contents[static_cast<std::size_t>(match.query)],
                           contents[static_cast<std::size_t>(match.match)],
                           shift_tolerance_columns)));
  }
  return matrix;
}

}  // namespace loopbit::report
