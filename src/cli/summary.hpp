// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "loopbit/run_folder.hpp"

namespace loopbit::cli {

/// Prints what a finished run comes to, for people, on stdout.
void print_summary(const RunRecord& record, const RunFolder& folder, bool has_report);

/// A share of `whole`; "-" where there is nothing to be a share of.
std::string share_text(double share, std::int64_t whole, int decimals);

}  // namespace loopbit::cli
