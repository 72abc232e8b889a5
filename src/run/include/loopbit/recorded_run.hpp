// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/evaluation.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/loop_detector.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/run_folder.hpp"
#include "loopbit/runner.hpp"

namespace loopbit {

/// Where a run is kept, and what of it.
struct RunOutput {
  std::string folder;      ///< empty = beside the map, "town_session_2" for session 2 of "town.db"
  bool overwrite = false;  ///< an earlier run in the folder
  bool keep_images = false;  ///< a small picture of each place in the map
  std::size_t map_cache_mb = kMapCache_mb;
  std::vector<std::string> inputs = {};  ///< files that are read, and never replaced
};

/// A run of a new detector that leaves its evidence in a folder and, where one is named, its places
/// in a map. Call detect(), what is to be kept with it, and finish(), whatever happened before.
class RecordedRun {
 public:
  /// `record`: what is read, and with which settings; record.map_path names the map to continue.
  /// Throws Error as validate(), MapWriter and RunFolder do; the map is opened first, so that what
  /// refuses the run costs no earlier one. Kind option if neither folder nor map is named.
  RecordedRun(RunRecord record, const RunOutput& out);

  /// Runs over `source`, once, as run() does, with `listener` told of each frame after it is kept.
  /// The map is saved and closed, also where the run fails. `keep_evidence`: for write_report().
  /// Throws what run() throws, Error (kind output) where something cannot be kept, and Error (kind
  /// input) where the source has ended and no frame was readable.
  void detect(ImageSource& source, const RunListener& listener, bool keep_evidence,
              const std::atomic<bool>& stop);

  /// See RunFolder::write_positions.
  void keep_positions(const std::vector<std::optional<cv::Vec3d>>& positions_m);

  /// Scores what was detected, and keeps what it was scored by.
  void score(const GroundTruth& truth, const EvaluationOptions& options);

  /// Writes run.json with how it went. `stopped_by`: see RunRecord. Throws Error (kind output).
  void finish(const std::string& stopped_by);

  /// What detect() found damaged in the map and left out, a clause a thing.
  [[nodiscard]] const std::vector<std::string>& map_damage() const { return map_damage_; }

  [[nodiscard]] const RunRecord& record() const { return record_; }
  [[nodiscard]] const RunFolder& folder() const { return folder_; }

 private:
  RunRecord record_;
  std::shared_ptr<MapWriter> map_;  ///< null without one, and after detect()
  std::vector<std::string> map_damage_;
  std::optional<LoopDetector> detector_;
  RunFolder folder_;
};

}  // namespace loopbit
