// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

namespace loopbit {

/// The query's features whose nearest of the place has no nearer one in the query, without a ratio
/// test. `look`: of match_strongest() for the same pair. Linear in the features.
std::vector<Match> nearest_matches(const Features& query, const Features& place,
                                   const FirstLook& look);

/// How many of `matches` moved alike, at most one for each neighbourhood of the query: the largest
/// number of displacements in one square of a tenth of the image's width. It needs neither a ratio
/// test nor a geometry, so it still tells places apart by night. Hough voting as for weak geometric
/// consistency (Jegou, Douze, Schmid 2008). Linear in the matches.
int displacement_votes(const Features& query, const Features& place,
                       const std::vector<Match>& matches, double min_spacing_scales);

}  // namespace loopbit
