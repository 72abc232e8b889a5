// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/binary_content.hpp"

namespace loopbit::report {

/// xi of every two frames, for the eye.
struct SimilarityMatrix {
  int frames_per_cell = 1;
  cv::Mat1b cells;  ///< square; row = later frame, column = earlier; 255 = xi of 1
};

/// The largest xi in each cell of a matrix of at most 640 cells a side. Of more than 2,048 frames
/// so many are compared, evenly spaced. Deterministic on every processor.
SimilarityMatrix similarity_matrix(const std::vector<BinaryContent>& contents,
                                   int shift_tolerance_columns);

}  // namespace loopbit::report
