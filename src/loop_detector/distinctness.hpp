// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "loopbit/verification.hpp"

namespace loopbit {

/// Inliers of one frame and one of its candidates.
struct Sighting {
  std::ptrdiff_t step = 0;         ///< the candidate's
  std::ptrdiff_t first_visit = 0;  ///< see KnownLoops
  std::span<const Match> inliers;
};

/// How far the inliers of `sighting` tell its place from others: the mean over them of 1 / (1 + n),
/// where n other places of `all` have the query's feature among their inliers, too. In (0, 1]; 1
/// without inliers. Sightings fewer than 6 steps apart, or of stretches whose first visits are,
/// show one place and count once. What stands everywhere, such as doors of one make, is learned
/// from the map itself in this way, with no training. `all` is sorted by first_visit. Linear in the
/// inliers.
double distinctness(const Sighting& sighting, const std::vector<Sighting>& all);

}  // namespace loopbit
