// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "loopbit/detection.hpp"
#include "loopbit/run_record.hpp"

namespace loopbit {

// The files of a run folder.
inline constexpr const char* kLoopsFile = "loops.csv";
inline constexpr const char* kLateLoopsFile = "late_loops.csv";
inline constexpr const char* kEpochsFile = "epochs.csv";
inline constexpr const char* kRecordFile = "run.json";
inline constexpr const char* kEvidenceFile = "evidence.db";
inline constexpr const char* kTruthFile = "truth.csv";
inline constexpr const char* kNotFalseFile = "not_false.csv";
inline constexpr const char* kIgnoreFile = "ignore.csv";
inline constexpr const char* kUnknownFile = "unknown.csv";
inline constexpr const char* kPositionsFile = "positions.csv";
inline constexpr const char* kPosesFile = "relative_poses.csv";
inline constexpr const char* kPoseGraphFile = "relative_poses.g2o";
inline constexpr const char* kMatchedPosesFile = "matched_poses.tum";
inline constexpr const char* kCameraFile = "camera.yaml";
inline constexpr const char* kTrajectoryFile = "trajectory.csv";
inline constexpr const char* kCorrectedFile = "corrected.tum";
inline constexpr const char* kCorrectedKittiFile = "corrected.kitti";
inline constexpr const char* kJudgedLoopsFile = "judged_loops.csv";
inline constexpr const char* kGraphFile = "graph.g2o";
inline constexpr const char* kReportFile = "report.html";
/// Not replaced by a later run: it may hold frames that are nowhere else.
inline constexpr const char* kQueueFile = "queue.db";

/// The folder in a run folder for the run that is being replaced.
inline constexpr const char* kEarlierFolder = "earlier_run";

inline bool is_there(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::exists(file, error);
}

/// The first line of relative_poses.csv, without its end.
std::string poses_header();

/// "17", or "2:17" for frame 17 of session 2 of the map; empty without a match.
std::string match_cell(const Detection& detection);
std::string match_cell(const LateLoop& loop);

/// The text of run.json.
std::string to_json(const RunRecord& record);

/// Reads what to_json() wrote, in this version or an earlier one. Missing values keep their
/// defaults, and unknown keys are ignored. Throws Error (kind input) with `file`, key and value if
/// `json` is no record of a run, or a value has another type.
RunRecord run_record_from_json(const std::string& json, const std::string& file);

/// Reads the rows of a loops.csv. A last row without a line end was cut off and is dropped. Throws
/// Error (kind input) with file and line.
std::vector<Detection> read_detections(const std::string& path);

}  // namespace loopbit
