// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "query_shifts.hpp"

namespace loopbit {

QueryShifts::QueryShifts(const BinaryContent& query, int tolerance_columns)
    : shifted(tolerated_shifts(query, tolerance_columns)),
      per_group((shifted.size() + kMaxShiftGroups - 1) / kMaxShiftGroups) {
  for (std::size_t shift = 0; shift < shifted.size(); ++shift) {
    if (shift % per_group == 0) {
      group_counts.emplace_back();
      coarse_counts.emplace_back();
    }
    const BlockCounts counts = block_counts(shifted[shift]);
    raise(group_counts.back(), counts);
    raise(coarse_counts.back(), loopbit::coarse_counts(counts));
  }
}

}  // namespace loopbit
