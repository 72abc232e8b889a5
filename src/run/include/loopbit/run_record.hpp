// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "loopbit/detection.hpp"
#include "loopbit/evaluation.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/loop_graph.hpp"
#include "loopbit/version.hpp"

namespace loopbit {

/// RunRecord::stopped_by of a run that has not ended.
inline constexpr const char* kRunning = "running";

/// Statistics of a time over a run, in milliseconds.
struct TimeSummary {
  double mean = 0;
  double p50 = 0;
  double p99 = 0;
  double max = 0;
};

/// The computer of a run.
struct Machine {
  std::string processor = "unknown";
  int cores = 0;
  std::string kernel = {};  ///< instruction set in use
  std::string system = {};
};

/// What is counted and measured when a run has ended.
struct RunResults {
  int frames = 0;
  std::array<int, kAllStatuses.size()> by_status{};  ///< frames, in the order of kAllStatuses
  int late_loops = 0;
  int withdrawn_loops = 0;
  TimeSummary content_ms, retrieval_ms, features_ms, verification_ms, total_ms;
  double frames_per_s = 0;
  double peak_memory_mib = 0;
};

/// What a pose graph makes of a run's loops and its trajectory.
struct Correction {
  int keyframes = 0;  ///< frames with odometry
  std::array<int, kAllLoopVerdicts.size()>
      by_verdict{};  ///< loops, in the order of kAllLoopVerdicts
  int unjudged = 0;  ///< loops of frames without odometry
  /// With true positions: absolute trajectory error of the odometry and of the corrected
  /// trajectory.
  std::optional<double> odometry_error_m = std::nullopt;
  std::optional<double> corrected_error_m = std::nullopt;

  [[nodiscard]] int kept() const;
  [[nodiscard]] int rejected() const;
};

/// Everything in run.json; see docs/run_folder.md.
struct RunRecord {
  std::string input;        ///< as given by the user
  std::string description;  ///< description of the input, see ImageSource
  LoopDetectorOptions options;
  Sampling sampling = {};
  int threads = 1;
  int map_session = 0;        ///< session of this run, if there is a map
  std::string map_path = {};  ///< empty = none
  int map_reconnections = 0;  ///< how often the map's server was lost and reached again
  /// The file with what the map's server has not got; empty = none.
  std::string map_queue = {};
  std::int64_t map_queued_frames = 0;           ///< at the end
  std::int64_t map_unverified = 0;              ///< see MapWriter::unverified()
  std::vector<std::string> map_not_asked = {};  ///< see MapWriter::not_asked()
  /// "running", "end", "interrupt", or an error message. A killed run keeps "running".
  std::string stopped_by = "end";
  double wall_s = 0;  ///< reading and detecting
  std::vector<std::string> arguments =
      {};                      ///< of the command, without its name; empty for a library
  std::string early_end = {};  ///< of the input, see ImageSource
  std::string camera = {};     ///< calibration that measured relative poses; empty = none
  std::string odometry = {};   ///< its file; empty = none
  /// A sentence, if there is reason to doubt the odometry; see odometry_doubt().
  std::string odometry_doubt = {};
  std::optional<Correction> correction = std::nullopt;
  std::string truth = {};                          ///< description of the truth, for people
  int truth_every = 1;                             ///< see GroundTruth::every
  std::optional<Evaluation> score = std::nullopt;  ///< read without its lists
  std::string version = kVersion;                  ///< of the loopbit that wrote it
  Machine machine = {};
  std::optional<RunResults> results = std::nullopt;  ///< none while the run is running

  /// Whether the run came to its end, or was interrupted in order.
  [[nodiscard]] bool has_ended() const { return stopped_by == "end" || stopped_by == "interrupt"; }
};

/// Why the odometry may be wrong: a sentence if more frames show a place that is out of reach by
/// odometry than one that is in reach, if the pose graph rejects more than a tenth of the loops, or
/// if the odometry jumps, with no loop across, or stands still to the end. Empty otherwise.
std::string odometry_doubt(const std::vector<Detection>& detections,
                           const std::optional<Correction>& correction);

/// Total time of all steps.
double total_ms(const StepTimes& times);

/// The statistics of a time, such as &StepTimes::content_ms or total_ms, over the readable frames;
/// zeros if there are none.
TimeSummary summarize(const std::vector<Detection>& detections,
                      const std::function<double(const StepTimes&)>& time_ms);

}  // namespace loopbit
