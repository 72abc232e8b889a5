// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace loopbit {

using FrameTimes = std::vector<std::optional<double>>;  ///< one per frame, if it has a time

/// The frames of a sequence that were read, as far as they are known.
struct FramesRead {
  int every = 1;            ///< only every N-th frame of the sequence
  FrameTimes times_s = {};  ///< one per frame read; empty if they are not known
  bool all = false;         ///< the sequence ends with them
};

/// All frames first..last show the place of frame `query`.
struct PlaceRun {
  int query = 0;
  int first = 0;
  int last = 0;

  bool operator==(const PlaceRun&) const = default;
};

/// The ground truth of a sequence, counted in its frames. A query may be in several runs.
struct GroundTruth {
  std::vector<PlaceRun> same_place = {};  ///< true earlier places
  std::vector<PlaceRun> near_place = {};  ///< not wrong; right only if also a true place
  std::vector<int> ignored = {};          ///< queries that are not scored
  /// Frames of unknown places: not scored as queries, and never wrong as matches.
  std::vector<int> unknown = {};
  /// Only every N-th frame of the sequence was read. Frame k of the run is frame k * every here.
  int every = 1;
  int frames = 0;  ///< number of frames that the truth covers; 0 = unknown
};

/// Reads rows of `query,first,last`, or rows of `query,match`, separated by commas or spaces, with
/// 0 <= first <= last < query: places are earlier frames. Blank lines, `#` comments and a header
/// row in this order are skipped; another header is refused if there are no rows. Throws Error
/// (kind input) with file and line for anything else.
std::vector<PlaceRun> read_place_runs(const std::string& path);

/// Reads the frame at the start of each row; text after a comma is a remark. Errors as above.
std::vector<int> read_frame_list(const std::string& path);

/// Throws Error (kind option) if `every` is less than 1: see GroundTruth::every.
void check_every(int every);

/// The part of `truth` for every N-th frame (1 = all), numbered by the frames read. Places without
/// a frame that was read are lost; GroundTruth::every keeps them. Throws as check_every() does.
GroundTruth every_nth(const GroundTruth& truth, int every);

/// Writes a comment line and rows of `query,first,last`, or their header if there are none. Throws
/// Error (kind output).
void write_place_runs(const std::string& path, const std::string& comment,
                      const std::vector<PlaceRun>& runs);

}  // namespace loopbit
