// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "loopbit/evaluation.hpp"
#include "loopbit/finished_run.hpp"

namespace loopbit {

/// One column of a comparison: a run of loopbit, or what another detector said of the same images.
struct ReportRun {
  std::string name;
  MatchList list;
  std::optional<FinishedRun> run;  ///< none for another detector
  /// Camera centres, one a frame; empty where they are not known.
  std::vector<std::optional<cv::Vec3d>> positions_m;
  std::optional<GroundTruth> truth;
  EvaluationOptions evaluation;
};

struct ReportOptions {
  /// Pictures are left out, evenly, where they would take more than this.
  double max_pictures_mb = 12.0;
};

/// Writes one HTML file that shows `runs`, needs nothing beside it and asks nothing of a network.
/// Throws Error: kind input if a run's evidence is damaged or it has over 2,000,000 frames, output
/// if `path` cannot be written. Cost: about a second for 10,000 frames.
void write_report(const std::string& path, const std::vector<ReportRun>& runs,
                  const ReportOptions& options = {});

/// The JSON in the page; web/src/report_data.ts tells what is in it.
std::string report_json(const std::vector<ReportRun>& runs, const ReportOptions& options = {});

}  // namespace loopbit
