// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace loopbit {

/// The frames first..last, all of them, show the place that frame `query` shows.
struct PlaceRun {
  int query = 0;
  int first = 0;
  int last = 0;

  bool operator==(const PlaceRun&) const = default;
};

/// What is true about a sequence, in the numbers of its frames. A query may be in several runs.
struct GroundTruth {
  std::vector<PlaceRun> same_place = {};  ///< true earlier places
  std::vector<PlaceRun> near_place = {};  ///< a match here is not false, nor right by this alone
  std::vector<int> ignored = {};          ///< queries that are not scored
  /// Frames of which nobody knows what they show: not scored, and no match with them is false.
  std::vector<int> unknown = {};
  /// Of the sequence's frames every so-many-th was read: the k-th of them is frame k * every here.
  int every = 1;
  int frames = 0;  ///< how many frames of the sequence are told of; 0 = not known
};

/// Reads rows of `query,first,last` or, all of them, `query,match` (spaces do for commas, too) with
/// 0 <= first <= last < query: places are earlier frames. Blank lines, `#` comments and a first row
/// of names, in this order, are passed over; other names are refused where they are all there is.
/// Throws Error (kind input) that names file and line for
/// anything else.
std::vector<PlaceRun> read_place_runs(const std::string& path);

/// Reads the frame that begins each row; what follows a comma is a remark. Errors as above.
std::vector<int> read_frame_list(const std::string& path);

/// Throws Error (kind option) if `every` is less than 1: see GroundTruth::every.
void check_every(int every);

/// What `truth`, of all frames, says of every `every`-th (1 = all), in the numbers of the frames
/// read. A place none of whose frames was read is lost; GroundTruth::every loses nothing. Throws
/// as check_every() does.
GroundTruth every_nth(const GroundTruth& truth, int every);

/// Writes rows of `query,first,last`, or their names if there are none, under a line of `comment`.
/// Throws Error (kind output).
void write_place_runs(const std::string& path, const std::string& comment,
                      const std::vector<PlaceRun>& runs);

}  // namespace loopbit
