// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace loopbit {

/// What a detector, any detector, says about a frame.
struct ReportedMatch {
  int query = 0;
  int match = 0;
  double score = 0;     ///< larger is surer
  bool is_loop = true;  ///< the detector's own decision

  bool operator==(const ReportedMatch&) const = default;
};

/// What a detector says about a sequence.
struct MatchList {
  std::vector<ReportedMatch> matches = {};  ///< in the order of the file
  /// One a frame; empty where frames are not listed.
  std::vector<std::optional<double>> times_s = {};
  /// Queries whose accepted match is a frame of another recording, which truth does not tell of.
  std::vector<int> elsewhere = {};
};

/// Reads a CSV file of matches. A first row of names gives the columns their meaning: `query` or
/// `frame`, `match`, `score`, and of loopbit's own loops.csv `status` (`loop` = accepted; other
/// rows with a match are candidates that were rejected) and `timestamp`; other columns are passed
/// over. Without names rows are `query,match` or `query,match,score`. Where there is no score all
/// matches have score 1. Rows with an empty match say that the frame has none. `#` begins a
/// comment. A match is an earlier frame; one `S:F` is frame F of another recording, S, in a file
/// with a column `frame`. If there is a column `frame`, every frame must have its row, in order,
/// from 0. Throws Error (kind input) that names file and line.
MatchList read_match_list(const std::string& path);

}  // namespace loopbit
