// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "loopbit/ground_truth.hpp"

namespace loopbit::truth {

/// Adds `places` to `runs`; lengthens the last run if it can.
inline void add_places(std::vector<PlaceRun>& runs, const PlaceRun& places) {
  if (!runs.empty() && runs.back().query == places.query && runs.back().last + 1 == places.first) {
    runs.back().last = places.last;
  } else {
    runs.push_back(places);
  }
}

}  // namespace loopbit::truth
