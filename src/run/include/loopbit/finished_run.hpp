// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/camera.hpp"
#include "loopbit/detection.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/match_list.hpp"
#include "loopbit/relative_pose.hpp"
#include "loopbit/run_record.hpp"
#include "loopbit/scoring.hpp"

namespace loopbit {

/// The relative pose of a loop, as relative_poses.csv has it.
struct LoopPose {
  PlaceId query = 0;
  std::optional<PlaceId> match = std::nullopt;               ///< as in Detection
  std::optional<SessionFrame> earlier_match = std::nullopt;  ///< as in Detection
  RelativePose pose = {};                                    ///< without the list of its inliers
  int inliers = 0;
};

/// A row of trajectory.csv.
struct CorrectedPosition {
  PlaceId frame = 0;
  cv::Vec3d odometry_m;
  cv::Vec3d corrected_m;
};

/// The verdict of the pose graph on a loop, as judged_loops.csv has it.
struct LoopJudgement {
  PlaceId query = 0;
  PlaceId match = 0;
  LoopVerdict verdict = LoopVerdict::undecided;
};

/// The folder of a run; see docs/run_folder.md.
struct FinishedRun {
  std::string path;
  std::vector<Detection> detections;
  std::string record_json;           ///< the text of run.json; empty if there is none
  std::optional<RunRecord> record;   ///< what it says
  std::optional<GroundTruth> truth;  ///< the truth that the run was given
  /// Camera centres, one per frame; empty if the run had no poses.
  std::vector<std::optional<cv::Vec3d>> positions_m;
  std::string evidence_path;                  ///< empty if there is none
  std::vector<LoopPose> poses;                ///< empty if none were measured
  std::optional<CameraModel> camera;          ///< of the images, if it is known
  std::vector<CorrectedPosition> trajectory;  ///< empty if it was not corrected
  std::vector<LoopJudgement> judged_loops;

  /// The frames of the run, with their times.
  [[nodiscard]] FramesRead frames() const;

  /// The truth that the run was given, and how it was scored.
  [[nodiscard]] Scoring scoring() const;
};

/// Whether a run writes a file of this name, without a folder.
bool is_run_file(const std::string& name);

/// Reads a run folder, also of an interrupted run. Throws Error (kind input) if `path` has no run,
/// one of its files is malformed, or a run that has ended lacks frames.
FinishedRun read_run(const std::string& path);

/// Converts detections to a MatchList.
MatchList match_list(const std::vector<Detection>& detections);

/// The loops within this session as lines "NAME MATCH_NAME" with names of images, the form in which
/// hloc and COLMAP read pairs: also those found late, without those withdrawn. Throws Error (kind
/// input) if a name cannot stand in such a line.
std::string image_pairs(const std::vector<Detection>& detections);

}  // namespace loopbit
