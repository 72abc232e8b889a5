// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <system_error>

namespace loopbit {

// The files of a run folder.
inline constexpr const char* kLoopsFile = "loops.csv";
inline constexpr const char* kRecordFile = "run.json";
inline constexpr const char* kEvidenceFile = "evidence.db";
inline constexpr const char* kTruthFile = "truth.csv";
inline constexpr const char* kNotFalseFile = "not_false.csv";
inline constexpr const char* kIgnoreFile = "ignore.csv";
inline constexpr const char* kUnknownFile = "unknown.csv";
inline constexpr const char* kPositionsFile = "positions.csv";
inline constexpr const char* kReportFile = "report.html";

/// The folder in a run folder for the run that is being replaced.
inline constexpr const char* kEarlierFolder = "earlier_run";

inline bool is_there(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::exists(file, error);
}

}  // namespace loopbit
