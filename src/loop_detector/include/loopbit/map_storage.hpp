// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <memory>

#include <opencv2/core.hpp>

#include "loopbit/binary_content.hpp"
#include "loopbit/detection.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/place_index.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

/// What a LoopDetector needs of a map that outlives it; see map_file.hpp for the one on disk. The
/// map's places are numbered from 0: those of earlier sessions in order of session and frame, then
/// each frame that is added. One thread at a time.
class MapStorage {
 public:
  using Visit = std::function<void(const SessionFrame&, const BinaryContent&)>;
  using VisitLoop = std::function<void(const SessionFrame& query, const SessionFrame& match)>;

  MapStorage() = default;
  virtual ~MapStorage() = default;
  MapStorage(const MapStorage&) = delete;
  MapStorage& operator=(const MapStorage&) = delete;
  MapStorage(MapStorage&&) = delete;
  MapStorage& operator=(MapStorage&&) = delete;

  /// Throws Error (kind option) if places that `options` makes cannot be compared with the map's:
  /// those of binary_content and surf must be the same.
  virtual void check_options(const LoopDetectorOptions& options) = 0;

  /// Calls back with each place of earlier sessions, in order.
  virtual void for_each_earlier_place(const Visit& visit) = 0;

  /// Calls back with each loop of earlier sessions, in the order in which they were found.
  virtual void for_each_earlier_loop(const VisitLoop& visit) = 0;

  /// The features of a place; without any if they are lost. Never null.
  virtual std::shared_ptr<const Features> features(PlaceId place) = 0;

  /// Takes the next frame of this session, as number detection.frame. Where the detection is
  /// `unreadable`, content, features and image are empty, and nothing but its number is kept. The
  /// image is what the detector was given: it may be overwritten afterwards. Throws Error (kind
  /// output) if this frame, or one before, could not be kept.
  virtual void add(const Detection& detection, const BinaryContent& content,
                   std::shared_ptr<const Features> features, const cv::Mat& image) = 0;
};

}  // namespace loopbit
