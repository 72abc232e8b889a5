// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "loopbit/detection.hpp"
#include "loopbit/evidence_file.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/loop_detector.hpp"

namespace loopbit {

/// Callbacks of a run.
struct RunListener {
  std::function<void(const Detection&)> on_detection;    ///< for each frame, in order
  std::function<void(const std::string&)> on_bad_frame;  ///< one sentence; its row follows
  /// Optional: for each readable frame, after on_detection.
  std::function<void(const Detection&, const cv::Mat& image, const Evidence&)> on_evidence = {};
  /// Optional, called by record_run() only: before the first frame, with the run's folder.
  std::function<void(const std::string& folder)> on_start = {};
  /// Optional, called by record_run() only: what it stores of a readable frame, after on_detection.
  std::function<void(const Detection&, const StoredEvidence&)> on_stored = {};
  /// Optional, called by record_run() only: after the last frame, with the loops that its pose
  /// graph rejects, if there are any.
  std::function<void(const std::vector<LateLoop>&)> on_rejected = {};
  /// Optional, called by record_run() only: a sentence on the map's server.
  std::function<void(const std::string&)> on_notice = {};
};

/// Checks the first usable frame. Throws Error (kind option) if exclusion.seconds is set and the
/// frame has no time, because the others have none either.
void check_time(const Frame& frame, const LoopDetectorOptions& options);

/// What odometry says at a frame, asked in order, once for each.
using FrameOdometry = std::function<std::optional<OdometryPose>(const Frame&)>;

/// Processes `source` frame by frame to its end, or until `stop` is true. A frame that is
/// unreadable is reported and gets the status unreadable, and the run continues. Frames may differ
/// in size: each is scaled by itself. Errors of the listener end the run. `odometry`: empty = there
/// is none. `threads`: with 1, all is done in this one; with more, another one reads and prepares
/// the next frames, at most three, and a run that stops early leaves them out. Throws Error (kind
/// option), see check_time().
void run(ImageSource& source, LoopDetector& detector, const RunListener& listener,
         const std::atomic<bool>& stop, const FrameOdometry& odometry = {}, int threads = 1);

}  // namespace loopbit
