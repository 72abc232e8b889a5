// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "loopbit/verification.hpp"

#include "known_loops.hpp"

namespace loopbit {

/// Where along the path a place lies.
struct Spot {
  std::ptrdiff_t step = 0;
  std::ptrdiff_t first_visit = 0;  ///< see KnownLoops
};

/// That of a step.
Spot spot_of(std::ptrdiff_t step, const KnownLoops& loops);

/// Fewer than 6 steps apart, or their first visits.
bool is_same_place(const Spot& a, const Spot& b);

/// Inliers of one frame and one of its candidates.
struct Sighting {
  Spot spot;  ///< the candidate's
  std::span<const Match> inliers;
};

/// How far the inliers of `sighting` tell its place from others: the mean over them of 1 / (1 + n),
/// where n other places of `all` have the query's feature among their inliers, too. In (0, 1]; 1
/// without inliers. Sightings of one place count once. What stands everywhere, such as doors of one
/// make, is learned from the map itself in this way, with no training. `all` is sorted by first
/// visit. Linear in the inliers.
double distinctness(const Sighting& sighting, const std::vector<Sighting>& all);

}  // namespace loopbit
