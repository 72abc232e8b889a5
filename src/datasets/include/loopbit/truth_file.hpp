// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

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
  PoseTruthOptions poses;
  std::string variable;   ///< of a .mat file; empty = the only square matrix in it
  int views = 1;          ///< a matrix has so many rows a frame in turn (2: left, right)
  int every = 1;          ///< of the sequence's frames every so-many-th was read
  bool all_read = false;  ///< of the frames read, that the sequence has none after them
};

/// Reads the ground truth of a sequence. The kind of the file is detected:
///  - a .mat file of MATLAB 5 to 7.3: a square matrix, dense (at most 1 GiB) or sparse, of any
///    numeric or logical class;
///  - an image: a square mask, true where it is not black; not JPEG, which does not keep black
///  exact;
///  - text of 12, 8 or 17 numbers per row: poses, see poses.hpp;
///  - text of `query,first,last` or `query,match` rows, see ground_truth.hpp;
///  - text with as many numbers per row as rows (at least 13): a square matrix.
/// In a matrix, rows and columns are frames. Every entry but 0 is true, above or below the
/// diagonal; the later of two frames is the query. The diagonal is ignored. With `views` = n, frame
/// k is rows n k to n k + n - 1, and two frames show the same place if any of their views do. At
/// most 100,000 rows are read.
///
/// Truth has the numbers of the whole sequence, and `every` of the options. Where a matrix has n
/// views and only every n-th image was read (the left ones of pairs in turn), its frames are those
/// read; other numbers that n does not divide fit no matrix of views.
///
/// `times_s`: the times of the frames read, one a frame, where they are known (0 frames = not
/// known). A trajectory goes by time where any frame has one, and by number, a row a frame of the
/// whole sequence, where they are known to have none: then the trajectory must have one for each
/// frame. Other rows are never fewer than frames. They may be more, as of a run that ended early,
/// unless `all_read`, which also refuses later frames in a list.
///
/// Truth without a true place is refused, unless it is by poses, or a list of no rows that names
/// its columns. Throws Error (kind input) that names file, fault and remedy. A 4541 x 4541 matrix
/// takes well under a second.
GroundTruth read_truth(const std::string& path, const TruthOptions& options = {},
                       const std::vector<std::optional<double>>& times_s = {});

}  // namespace loopbit
