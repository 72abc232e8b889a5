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

/// What thinning knows of a place.
struct ThinnedPlace {
  BinaryContent content;
  int session = 0;
  std::optional<std::size_t> loop = std::nullopt;  ///< the place that a loop matched it with
};

/// Which of `places`, in order of session and frame, to keep so that at most `max_places` remain.
///
/// A place is redundant if another one can represent it: the most similar (xi, with the shifts that
/// retrieval tolerates) of its neighbours in the session and the place that a loop matched it with.
/// Dropping a place costs 1 - xi, plus the largest cost of the dropped places that it represented.
/// The cheapest places are dropped first. Takes about 10 us per place.
std::vector<bool> kept_places(const std::vector<ThinnedPlace>& places, std::size_t max_places);

/// The ids of the places that remain in a compacted map.
std::set<std::int64_t> remaining_places(MapReader& map, const CompactOptions& options);

}  // namespace loopbit
