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

/// The output of a run.
struct RunOutput {
  std::string folder;      ///< empty = beside the map, "town_session_2" for session 2 of "town.db"
  bool overwrite = false;  ///< an earlier run in the folder
  bool keep_images = false;  ///< a small picture of each place in the map
  std::size_t map_cache_mb = kMapCache_mb;
  std::vector<std::string> inputs = {};  ///< input files, which are never replaced
};

/// A run of a new detector that writes a run folder and, if a map is given, its places to the map.
/// Call detect(), then the functions for further data, and always finish().
class RecordedRun {
 public:
  /// `record` has the input and the settings; record.map_path is the map to continue. Throws Error
  /// as validate(), MapWriter and RunFolder do. The map is opened first, so that a refused run does
  /// not replace an earlier one. Kind option if neither folder nor map is given.
  RecordedRun(RunRecord record, const RunOutput& out);

  /// Runs once over `source`, like run(), and calls `listener` for each frame after it is saved.
  /// The map is saved and closed, even if the run fails. `keep_evidence` stores data for
  /// write_report(). Throws what run() throws, Error (kind output) if something cannot be saved,
  /// and Error (kind input) if the source has ended without a readable frame.
  void detect(ImageSource& source, const RunListener& listener, bool keep_evidence,
              const std::atomic<bool>& stop);

  /// See RunFolder::write_positions.
  void keep_positions(const std::vector<std::optional<cv::Vec3d>>& positions_m);

  /// Scores the detections, and stores the truth.
  void score(const GroundTruth& truth, const EvaluationOptions& options);

  /// Writes the final run.json. `stopped_by`: see RunRecord. Throws Error (kind output).
  void finish(const std::string& stopped_by);

  /// The damage that detect() found in the map, one clause each. Damaged rows were left out.
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
