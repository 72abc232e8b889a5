// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "loopbit/report.hpp"

#include "truth_flags.hpp"

namespace loopbit::cli {

/// A run, and the frames that it is about.
struct ListedRun {
  ReportRun run;
  FramesRead frames;
};

/// What PATH or NAME=PATH says: a run folder, with the truth it was given, or a CSV of any
/// detector's matches. Throws Error.
ListedRun listed_run(const std::string& text);

/// Gives `run` the truth and the poses that the flags name, if any, before those of its folder, as
/// they are of `frames`. Throws Error.
void take_truth(ReportRun& run, const TruthFlags& flags, const FramesRead& frames);

/// listed_run with the truth and the poses of its own frames.
ReportRun report_run(const std::string& text, const TruthFlags& flags = {});

/// The page that shows the run in `folder`.
std::string report_in(const std::string& folder);

/// As report_run, but an Error (kind option) where there is no truth.
ReportRun scored_run(const std::string& text, const TruthFlags& flags);

}  // namespace loopbit::cli
