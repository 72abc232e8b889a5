// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "loopbit/run_folder.hpp"

namespace loopbit::cli {

/// Prints what a finished run comes to, for people, on stdout.
void print_summary(const RunRecord& record, const RunFolder& folder, bool has_report);

}  // namespace loopbit::cli
