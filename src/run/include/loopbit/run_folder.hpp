// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "loopbit/detection.hpp"
#include "loopbit/evaluation.hpp"
#include "loopbit/loop_detector_options.hpp"

namespace loopbit {

/// What a run has to say beside its detections; see docs/run_folder.md.
struct RunRecord {
  std::string input;        ///< as given by the user
  std::string description;  ///< of the input, see ImageSource
  LoopDetectorOptions options;
  int every = 1;  ///< of the input's frames, every so-many-th was read
  int limit = 0;  ///< at most so many were read; 0 = all
  int threads = 1;
  std::string stopped_by = "end";  ///< "end", "interrupt", or the sentence of an error
  double wall_s = 0;               ///< reading and detecting
  std::optional<DecisionCounts> score = std::nullopt;
};

/// A folder that a run leaves its evidence in: loops.csv, a row a frame, complete at any moment;
/// and run.json, written when the run ends for whatever reason.
class RunFolder {
 public:
  /// Makes the folder and begins loops.csv. Throws Error (kind output) if the folder holds an
  /// earlier run and `overwrite` is not set, or if it cannot be written.
  RunFolder(const std::string& path, bool overwrite);

  /// Appends a row and hands it to the system, so that it survives this process. Throws Error (kind
  /// output) if the disk is full; rows written before are kept.
  void add(const Detection& detection);

  /// Writes run.json, all of it or nothing. Throws Error (kind output).
  void finish(const RunRecord& record);

  [[nodiscard]] const std::vector<Detection>& detections() const { return detections_; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  void append(const std::string& row);

  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  std::string path_;
  std::unique_ptr<std::FILE, CloseFile> loops_;  ///< unbuffered
  std::int64_t loops_bytes_ = 0;                 ///< of whole rows
  std::vector<Detection> detections_;
};

/// Mean and spread of one step's time over a run, in milliseconds.
struct TimeSummary {
  double mean = 0;
  double p50 = 0;
  double p99 = 0;
  double max = 0;
};

/// The summary of one step over the frames that were readable; zeros if there are none.
TimeSummary summarize(const std::vector<Detection>& detections, double StepTimes::*step);

/// The header of loops.csv, without a line end.
inline constexpr const char* kLoopsHeader =
    "frame,timestamp,status,match,score,similarity,matches,inliers,"
    "content_ms,retrieval_ms,features_ms,verification_ms";

}  // namespace loopbit
