// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "loopbit/binary_content.hpp"
#include "loopbit/map_tools.hpp"

namespace loopbit {

/// A place as thinning sees it.
struct ThinnedPlace {
  BinaryContent content;
  int session = 0;
  std::optional<std::size_t> loop = std::nullopt;  ///< the place that it was found to be
};

/// Which of `places`, in order of session and frame, are kept so that at most `max_places` are.
///
/// A place is redundant where another one stands for it: the most similar (xi, with the shifts that
/// retrieval tolerates) of its neighbours in the session and the place that a loop found it to be.
/// Removing it costs 1 - xi, and what those that it stands for itself have cost. The cheapest goes
/// first, until the budget is met. Cost: some 10 microseconds a place.
std::vector<bool> kept_places(const std::vector<ThinnedPlace>& places, std::size_t max_places);

/// The ids of the places that compacting a map leaves.
std::set<std::int64_t> remaining_places(MapReader& map, const CompactOptions& options);

}  // namespace loopbit
