// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "loopbit/ground_truth.hpp"
#include "loopbit/poses.hpp"

namespace loopbit {

/// The kind of a file of ground truth.
enum class TruthKind {
  runs,    ///< rows of query,first,last or query,match
  matrix,  ///< one cell per pair of frames
  poses,   ///< camera poses
};

/// The kind of a file of ground truth, as read_truth would read it. Throws Error (kind input).
TruthKind truth_kind(const std::string& path);

/// How to interpret a file of ground truth if its kind leaves that open.
struct TruthOptions {
  PoseTruthOptions poses = {};
  std::string variable = {};  ///< of a .mat file; empty = the only square matrix in it
  int views = 1;              ///< rows of a matrix per frame (2: left, right)
};

/// Reads the ground truth of a sequence. The kind of the file is detected:
///  - a .mat file of MATLAB 5 to 7.3: a square matrix, dense (at most 1 GiB) or sparse, of any
///    numeric or logical class;
///  - an image: a square mask, true where it is not black; not JPEG, which changes black;
///  - text of 12, 8 or 17 numbers per row: poses, see poses.hpp;
///  - text of `query,first,last` or `query,match` rows, see ground_truth.hpp;
///  - text with as many numbers per row as rows (at least 13): a square matrix.
/// In a matrix, rows and columns are frames. Every entry but 0 is true, above or below the
/// diagonal; the later of two frames is the query. The diagonal is ignored. With `views` = n, frame
/// k is rows n k to n k + n - 1, and two frames show the same place if any of their views do. At
/// most 100,000 rows are read.
///
/// Truth counts the frames of the whole sequence, and has `every` of `frames`. If a matrix has n
/// views and only every n-th image was read (the left ones of alternating pairs), its frames are
/// the images read. Other values of `every` above 1 must be multiples of n.
///
/// A trajectory is matched by time if any frame has one. If the frames have no times, it is matched
/// by number and must have one row per frame of the whole sequence. Other files must not have fewer
/// rows than frames. They may have more, as for a run that ended early, unless the frames are
/// `all`, which also refuses later frames in a list.
///
/// Truth without a true place is refused, unless it is by poses, or a list of no rows that names
/// its columns. Throws Error (kind input) with file, fault and remedy. A 4541 x 4541 matrix
/// takes well under a second.
GroundTruth read_truth(const std::string& path, const TruthOptions& options = {},
                       const FramesRead& frames = {});

}  // namespace loopbit
