// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "loopbit/evaluation.hpp"
#include "loopbit/finished_run.hpp"

namespace loopbit {

/// One row of a comparison: a run of loopbit, or another detector's matches on the same images.
struct ReportRun {
  std::string name;
  MatchList list;
  std::optional<FinishedRun> run;  ///< none for another detector
  /// Camera centres, one per frame; empty if they are not known.
  std::vector<std::optional<cv::Vec3d>> positions_m;
  std::optional<GroundTruth> truth;
  EvaluationOptions evaluation;
};

/// `run` as it is, under a name.
ReportRun to_report_run(const std::string& name, FinishedRun run);

struct ReportOptions {
  /// If the pictures would take more than this, some are left out evenly.
  double max_pictures_mb = 12.0;
};

/// Writes one self-contained HTML file that shows `runs` and needs no network. Throws Error: kind
/// input if a run's evidence is damaged or it has over 2,000,000 frames, kind output if `path`
/// cannot be written. Cost: about a second for 10,000 frames.
void write_report(const std::string& path, const std::vector<ReportRun>& runs,
                  const ReportOptions& options = {});

}  // namespace loopbit
