// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/detection.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/run_record.hpp"

namespace loopbit {

class EarlierRun;

/// The folder of a run. loops.csv has one row per frame and is complete at any time, late_loops.csv
/// has what later frames changed. run.json is written when the run begins, and again when it ends.
class RunFolder {
 public:
  /// Makes the folder and begins loops.csv. Throws Error (kind output) if the folder holds an
  /// earlier run and `overwrite` is not set, if one of its files is among `inputs` or of no run (a
  /// data set has a truth.csv, too), or if it cannot be written. An earlier run is set aside in a
  /// folder `earlier_run` inside, removed when this one has ended, and put back if this one leaves
  /// no row.
  RunFolder(const std::string& path, bool overwrite, const std::vector<std::string>& inputs = {});
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;
  RunFolder(RunFolder&&) = delete;
  RunFolder& operator=(RunFolder&&) = delete;

  /// Appends a row and hands it to the system, so that it survives this process. Throws Error (kind
  /// output) if the disk is full; rows written before are kept.
  void add(const Detection& detection);

  /// Withdraws loops after the last frame, in its name. Throws Error (kind output).
  void withdraw(const std::vector<LateLoop>& loops);

  /// Writes the ground truth, so that the run can be scored and shown again without the original
  /// files: truth.csv, not_false.csv, ignore.csv, unknown.csv, counted in frames of the whole
  /// sequence; see RunRecord::truth_every. Throws Error (kind output).
  void write_truth(const GroundTruth& truth);

  /// Writes positions.csv: camera centres, one per frame. Throws Error (kind output).
  void write_positions(const std::vector<std::optional<cv::Vec3d>>& positions_m);

  /// Writes run.json anew, all of it or nothing. Once it is there, a full disk has room for how the
  /// run ends, unless its file system writes what is changed elsewhere. Throws Error (kind output).
  void write_record(const RunRecord& record);

  [[nodiscard]] const std::vector<Detection>& detections() const { return detections_; }
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string evidence_path() const;

 private:
  class Rows;

  void add_epoch(const Detection& detection);

  std::string path_;
  std::unique_ptr<EarlierRun> earlier_;
  std::unique_ptr<Rows> loops_;
  std::unique_ptr<Rows> late_loops_;
  std::unique_ptr<Rows> epochs_;  ///< null without a map on a server
  std::size_t late_rows_ = 0;
  std::vector<Detection> detections_;
};

/// The header of loops.csv, without a line end.
inline constexpr const char* kLoopsHeader =
    "frame,timestamp,status,match,score,similarity,matches,inliers,"
    "votes,geometry,path,rivals,prior,name,match_name,"
    "content_ms,retrieval_ms,features_ms,verification_ms";

/// The header of epochs.csv, without a line end.
inline constexpr const char* kEpochsHeader = "frame,epoch";

/// The header of late_loops.csv, without a line end, and its kinds.
inline constexpr const char* kLateLoopsHeader =
    "frame,kind,match,score,similarity,reported_at,name,match_name";
inline constexpr const char* kLate = "late";
inline constexpr const char* kWithdrawn = "withdrawn";

/// The header of positions.csv, without a line end.
inline constexpr const char* kPositionsHeader = "frame,x_m,y_m,z_m";

}  // namespace loopbit
