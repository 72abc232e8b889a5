// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "loopbit/report.hpp"

#include "truth_flags.hpp"

namespace loopbit::cli {

/// What PATH or NAME=PATH says: a run folder, with the truth it was given, or a CSV of any
/// detector's matches. Flags that name a truth or poses come before those of the folder. Throws
/// Error.
ReportRun report_run(const std::string& text, const TruthFlags& flags = {});

/// As report_run, but an Error (kind option) where there is no truth.
ReportRun scored_run(const std::string& text, const TruthFlags& flags);

}  // namespace loopbit::cli
