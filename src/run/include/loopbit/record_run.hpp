// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "loopbit/camera.hpp"
#include "loopbit/detection.hpp"
#include "loopbit/error.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/poses.hpp"
#include "loopbit/relative_pose.hpp"
#include "loopbit/run_input.hpp"
#include "loopbit/run_record.hpp"
#include "loopbit/runner.hpp"
#include "loopbit/scoring.hpp"

namespace loopbit {

/// What a run does with its input. The flags of `loopbit run` and the arguments of run_folder() in
/// Python set these fields.
struct RunRequest {
  LoopDetectorOptions options = {};
  int threads = 1;                          ///< see run()
  std::vector<std::string> arguments = {};  ///< of the command line, for run.json

  /// Empty = beside the map, "town_session_2" for session 2 of "town.db"; in the working folder for
  /// session 2 of the database "town" on a server.
  std::string folder = {};
  bool overwrite = false;    ///< an earlier run in the folder
  bool evidence = true;      ///< store what write_report() shows
  std::string map = {};      ///< the map to continue or to make; empty = none
  bool keep_images = false;  ///< a small picture of each place in the map
  std::size_t map_cache_mb = kMapCache_mb;

  ScoringRequest scoring = {};
  /// Of the frames that will be read; used if `scoring` names no file of truth.
  std::optional<GroundTruth> truth = std::nullopt;
  std::string truth_description = {};  ///< of `truth`, for people
  std::string poses = {};              ///< a file; empty = the file of truth, if that has poses
  std::optional<Positions> positions_m = std::nullopt;  ///< one per frame, in place of `poses`
  /// An image file that excludes part of all images, see read_mask(); empty = none.
  std::string mask = {};
  /// The camera of the images, to measure the relative pose of each loop.
  std::optional<CameraModel> camera = std::nullopt;
  std::string camera_file = {};  ///< where it is from, for messages and run.json
  /// A folder of depth images, so that translations get a length: of TUM RGB-D, with a depth.txt,
  /// or of images named like those of the run. Needs `camera`. Empty = none.
  std::string depth = {};
  double depth_scale = kTumDepthUnitsPerM;  ///< 16-bit depth: units per metre
  /// A file of camera poses by odometry, as read_trajectory() reads: tells places apart that look
  /// alike, and gives translations a length where there are no depth or right images. Empty = none.
  std::string odometry = {};
  /// After the run, corrects the trajectory by a pose graph of odometry and loops, and withdraws
  /// the loops that it rejects.
  bool correct = false;
  /// A folder with the images of a second camera, named like those of the run, so that translations
  /// get a length. Needs `camera`; excludes `depth`. Empty = none.
  std::string right = {};
  /// Of a rectified pair, metres: the second camera is like the first, this far to the right of it.
  /// 0 = by the calibration in the folder, or the second camera of `camera_file`.
  double baseline_m = 0;
  std::vector<std::string> other_inputs = {};  ///< more files that are never replaced
};

/// A mask for LoopDetector::set_mask() from an image file of 8 bits; colours become grey. Throws
/// Error (kind input) if it cannot be read, is black everywhere, has 16 bits or fewer than 32 x 32
/// pixels.
cv::Mat1b read_mask(const std::string& file);

/// The outcome of a run.
struct RunOutcome {
  std::string folder;
  RunRecord record;
  std::vector<Detection> detections;
  /// The damage that was found in the map, one clause each. Damaged rows were left out.
  std::vector<std::string> map_damage;
  /// What turned out to be wrong with the truth, the positions, the odometry or its correction. The
  /// run is kept without them.
  std::optional<Error> fault;
};

/// Runs a new detector over `input`, writes a run folder (see docs/run_folder.md) and, if a map is
/// given, adds the places to the map. Calls `listener` for each frame after it is saved. Once
/// `stop` is true, ends the run in order.
///
/// Checks the request before it touches anything, as far as possible. The map is opened first and
/// with `overwrite` a usable frame is read first, so that a refused run does not replace an earlier
/// one; with a camera or odometry, too, to check its size or time. If the run fails, or the
/// listener throws, run.json says why, the map has the places so far, and the exception goes on.
///
/// Throws Error: kind option for a request that contradicts itself or the input, or without a
/// folder and a map; kind input for files of truth, poses and odometry, for a mask, camera, depth
/// or second camera that does not fit the images, and if the input has ended without a readable
/// frame; kind output if something cannot be saved; and what MapWriter and run() throw.
RunOutcome record_run(RunInput& input, const RunRequest& request, const RunListener& listener,
                      const std::atomic<bool>& stop);

}  // namespace loopbit
