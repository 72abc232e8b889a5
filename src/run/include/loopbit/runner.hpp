// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "loopbit/detection.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/loop_detector.hpp"

namespace loopbit {

/// What a run tells while it goes.
struct RunListener {
  std::function<void(const Detection&)> on_detection;    ///< for each frame, in order
  std::function<void(const std::string&)> on_bad_frame;  ///< one sentence; its row follows
  /// Where wanted: for each frame that is readable, after on_detection.
  std::function<void(const Detection&, const cv::Mat& image, const Evidence&)> on_evidence = {};
};

/// Of the first frame that can be used: where it has no time, no other is any better. Throws Error
/// (kind option) if exclusion.seconds is set and it has none.
void check_time(const Frame& frame, const LoopDetectorOptions& options);

/// Reads `source` to its end, or until `stop` turns true, and detects frame by frame. A frame that
/// is unreadable, or whose size differs from the first one's, is reported and counted with the
/// status unreadable, and the run goes on. Errors from the listener end the run. Throws Error (kind
/// option), see check_time().
void run(ImageSource& source, LoopDetector& detector, const RunListener& listener,
         const std::atomic<bool>& stop);

}  // namespace loopbit
