// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include <opencv2/core.hpp>

#include "loopbit/detection.hpp"
#include "loopbit/evidence.hpp"
#include "loopbit/loop_detector_options.hpp"

namespace loopbit {

/// Tells for each camera image whether the camera has been at this place before.
///
/// H. Wang, J. Li, M. Ran, L. Xie, "Fast Loop Closure Detection via Binary Content", 2019: binary
/// content finds the earlier places that look alike, SURF features and epipolar geometry verify
/// them, and agreement with the frames just before decides with them. The same images give the same
/// answers on any processor. Not thread-safe; use one detector a thread.
///
/// Memory: at most 50 KB a place by default, nearly all of it features, and working memory of its
/// own, which it keeps from frame to frame.
class LoopDetector {
 public:
  /// Throws Error (kind option) if `options` are not valid.
  explicit LoopDetector(const LoopDetectorOptions& options = {});
  ~LoopDetector();
  LoopDetector(const LoopDetector&) = delete;
  LoopDetector& operator=(const LoopDetector&) = delete;
  /// A detector moved from may only be assigned to or destroyed.
  LoopDetector(LoopDetector&&) noexcept;
  LoopDetector& operator=(LoopDetector&&) noexcept;

  /// Detects, then adds the image as the next place.
  ///
  /// `image`: 8- or 16-bit, grey, BGR or BGRA, at least 32 x 32. `timestamp_s`: in seconds, not
  /// before the last one; needed only where the exclusion window is given in seconds.
  /// `evidence`: if not null, is given what the answer rests on, at the cost of one more
  /// verification. Throws Error (kind input), and stays as it was, if the image or the time cannot
  /// be used.
  Detection process(const cv::Mat& image, std::optional<double> timestamp_s = std::nullopt,
                    Evidence* evidence = nullptr);

  /// What process() would answer now, without adding anything.
  [[nodiscard]] Detection query(const cv::Mat& image,
                                std::optional<double> timestamp_s = std::nullopt) const;

  /// Counts a frame without a usable image, so that frame numbers keep step with the camera. It is
  /// never a candidate.
  Detection skip(std::optional<double> timestamp_s = std::nullopt);

  /// Frames so far.
  [[nodiscard]] PlaceId size() const;

  [[nodiscard]] const LoopDetectorOptions& options() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loopbit
