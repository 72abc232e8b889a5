// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "loopbit/ground_truth.hpp"

namespace loopbit {

/// A match reported by any detector.
struct ReportedMatch {
  int query = 0;
  int match = 0;
  double score = 0;     ///< larger means more certain
  bool is_loop = true;  ///< the detector's own decision

  bool operator==(const ReportedMatch&) const = default;
};

/// The matches of a detector on a sequence.
struct MatchList {
  std::vector<ReportedMatch> matches = {};  ///< in the order of the file
  FrameTimes times_s = {};                  ///< empty if frames are not listed
  /// Queries whose accepted match is in another recording, which truth does not cover.
  std::vector<int> elsewhere = {};
  /// What later frames changed of the decisions, in order: is_loop = a loop found late, otherwise
  /// one that was withdrawn. `match` is -1 in another recording.
  std::vector<ReportedMatch> changes = {};
};

/// The list with its changes made, and none left.
MatchList with_changes(MatchList list);

/// Reads a CSV file of matches. A header row names the columns: `query` or `frame`, `match`,
/// `score`, and in loopbit's loops.csv `status` (`loop` = accepted; other rows with a match are
/// rejected candidates) and `timestamp`. Other columns are skipped. Without a header, rows are
/// `query,match` or `query,match,score`. Without scores all matches have score 1. A row with an
/// empty match is a frame without a match. `#` begins a comment. A match is an earlier frame. In a
/// file with a column `frame`, `S:F` is frame F of another recording S, and every frame must have
/// its row, in order, from 0. Throws Error (kind input) with file and line.
MatchList read_match_list(const std::string& path);

}  // namespace loopbit
