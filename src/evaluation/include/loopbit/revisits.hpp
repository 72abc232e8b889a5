// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "loopbit/match_list.hpp"

namespace loopbit {

/// Loops in a row: the camera passes places in the order of an earlier pass, or in reverse.
struct Revisit {
  int first_query = 0;
  int last_query = 0;
  int first_match = 0;  ///< the match of first_query
  int last_match = 0;   ///< the match of last_query
  int loops = 0;

  bool operator==(const Revisit&) const = default;
};

/// The loops of `list` in groups, in the order of their first queries. A loop belongs to the group
/// whose last loop is at most 20 frames away in both query and match; among several, to the one
/// with the nearest match.
std::vector<Revisit> revisits(const MatchList& list);

}  // namespace loopbit
