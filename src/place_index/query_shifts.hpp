// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "loopbit/binary_content.hpp"

#include "block_counts.hpp"

namespace loopbit {

/// Shifts are bounded one by one up to so many; beyond, neighbours together.
inline constexpr std::size_t kMaxShiftGroups = 16;

/// A query at all tolerated shifts, and what bounds its overlap with any place.
struct QueryShifts {
  QueryShifts(const BinaryContent& query, int tolerance_columns);

  std::vector<BinaryContent> shifted;  ///< the query at each shift
  std::size_t per_group;
  std::vector<BlockCounts> group_counts;    ///< for each group of shifts, the maxima
  std::vector<CoarseCounts> coarse_counts;  ///< likewise
};

}  // namespace loopbit
