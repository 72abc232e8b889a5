// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "loopbit/ground_truth.hpp"

namespace loopbit::datasets {

/// Adds to `runs` that `place` shows what `query` shows: lengthens the last run if it can.
inline void add_place(std::vector<PlaceRun>& runs, int query, int place) {
  if (!runs.empty() && runs.back().query == query && runs.back().last + 1 == place) {
    runs.back().last = place;
  } else {
    runs.push_back({query, place, place});
  }
}

}  // namespace loopbit::datasets
