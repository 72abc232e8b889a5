// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "loopbit/record_run.hpp"

namespace loopbit::cli {

/// The rejected loops by their evidence, " (2 unreachable, 1 outlier)"; empty if there are none.
std::string evidence_text(const Correction& correction);

/// Prints what a finished run comes to, for people, on stdout. `report`: its file; may be empty.
void print_summary(const RunOutcome& run, const std::string& report);

/// A share of `whole`; "-" where there is nothing to be a share of.
std::string share_text(double share, std::int64_t whole, int decimals);

}  // namespace loopbit::cli
