// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/binary_content.hpp"
#include "loopbit/match_list.hpp"

namespace loopbit::report {

/// xi of pairs of frames, for display.
struct SimilarityMatrix {
  int frames_per_cell = 1;
  int compared_every = 1;  ///< every so-many-th frame was compared with every so-many-th
  cv::Mat1b cells;         ///< square; row = later frame, column = earlier; 255 = xi of 1
};

/// The largest xi in each cell of a matrix of at most 640 x 640 cells. At most 2,048 evenly spaced
/// frames are compared, and every frame of `matches` with its match. Deterministic on every
/// processor.
SimilarityMatrix similarity_matrix(const std::vector<BinaryContent>& contents,
                                   const std::vector<ReportedMatch>& matches,
                                   int shift_tolerance_columns);

}  // namespace loopbit::report
