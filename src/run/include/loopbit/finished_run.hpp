// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/detection.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/match_list.hpp"

namespace loopbit {

/// What a run left in its folder; see docs/run_folder.md.
struct FinishedRun {
  std::string path;
  std::vector<Detection> detections;
  std::string record_json;           ///< run.json; empty where there is none
  std::optional<GroundTruth> truth;  ///< as it was given to the run
  /// Camera centres, one a frame; empty where the run had no poses.
  std::vector<std::optional<cv::Vec3d>> positions_m;
  std::string evidence_path;  ///< empty where there is none
};

/// Reads a run folder, also one whose run was cut off. Throws Error (kind input) if `path` holds no
/// run or a file of it is malformed.
FinishedRun read_run(const std::string& path);

/// The rows of a loops.csv. A last row without a line end was cut off and is left out. Throws Error
/// (kind input) that names file and line.
std::vector<Detection> read_detections(const std::string& path);

/// What `detections` say, as any detector's list would.
MatchList match_list(const std::vector<Detection>& detections);

}  // namespace loopbit
