// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/detection.hpp"
#include "loopbit/evidence.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/map_storage.hpp"

namespace loopbit {

/// Tells for each camera image whether the camera has been at this place before.
///
/// H. Wang, J. Li, M. Ran, L. Xie, "Fast Loop Closure Detection via Binary Content", 2019: binary
/// content finds the earlier places that look alike, SURF features and epipolar geometry verify
/// them, and agreement with the frames just before decides with them. The same images give the same
/// answers on any processor. Not thread-safe; use one detector a thread.
///
/// Memory: at most 50 KB a place by default, nearly all of it features, and working memory of its
/// own, which it keeps from frame to frame. With a map, features are the map's to keep: 700 bytes a
/// place remain.
class LoopDetector {
 public:
  /// Throws Error (kind option) if `options` are not valid.
  explicit LoopDetector(const LoopDetectorOptions& options = {});

  /// Continues `map` with a new session: all places of earlier sessions are candidates, whatever
  /// the exclusion window. Features are kept there, and fetched when a candidate is verified.
  /// Throws as above, if the map was made with other settings of binary_content or surf, and what
  /// the map throws. Cost: some microseconds a place of the map.
  LoopDetector(const LoopDetectorOptions& options, std::shared_ptr<MapStorage> map);
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
  /// be used; so it does where memory for another place is refused (std::bad_alloc), and where
  /// MapStorage::add throws.
  Detection process(const cv::Mat& image, std::optional<double> timestamp_s = std::nullopt,
                    Evidence* evidence = nullptr);

  /// What process() would answer now, without adding anything. `ranking`: if not null, is given all
  /// candidates, best first, at the cost of verifying each of them; only the first can be a loop.
  [[nodiscard]] Detection query(const cv::Mat& image,
                                std::optional<double> timestamp_s = std::nullopt,
                                std::vector<RankedPlace>* ranking = nullptr) const;

  /// Counts a frame without a usable image, so that frame numbers keep step with the camera. It is
  /// never a candidate.
  Detection skip(std::optional<double> timestamp_s = std::nullopt);

  /// Frames of this session so far.
  [[nodiscard]] PlaceId size() const;

  [[nodiscard]] const LoopDetectorOptions& options() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loopbit
