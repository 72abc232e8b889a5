// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/binary_content.hpp"
#include "loopbit/detection.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/place_index.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

/// The places of a map that finds similar ones itself, so that a detector does not have to hold
/// their contents. They are numbered as in MapStorage. Not thread-safe.
class PlaceSearch {
 public:
  using Visit = std::function<void(const SessionFrame&, bool is_step)>;

  struct Similar {
    std::vector<Candidate> places = {};  ///< best first; of equal ones, the earlier place first
    bool is_all = false;                 ///< there are no others
  };

  PlaceSearch() = default;
  virtual ~PlaceSearch() = default;
  PlaceSearch(const PlaceSearch&) = delete;
  PlaceSearch& operator=(const PlaceSearch&) = delete;
  PlaceSearch(PlaceSearch&&) = delete;
  PlaceSearch& operator=(PlaceSearch&&) = delete;

  /// Calls `visit` for each place of earlier sessions, in order. The first one is a step, and so is
  /// each that is not empty and whose similarity with the last step before it is less than
  /// `unmoved`.
  virtual void for_each_place(double unmoved, const Visit& visit) = 0;

  /// The places most similar to a content that is shifted by up to the tolerance: at most `number`,
  /// and those as similar as the last of them. Damaged places count for `number`, but are
  /// left out.
  virtual Similar most_similar(const BinaryContent& content, int shift_tolerance_columns,
                               std::size_t number) = 0;

  virtual BinaryContent content(PlaceId place) = 0;
};

/// What others added to a map while a session was being added. Session 0 is that session.
struct MapNews {
  struct Place {
    SessionFrame at;
    BinaryContent content;
  };
  struct Loop {
    SessionFrame query;
    SessionFrame match;
  };

  std::int64_t epoch = 0;  ///< see Detection::epoch
  std::vector<Place> places = {};
  std::vector<Loop> loops = {};
  std::vector<Loop> rejected = {};
};

/// What a LoopDetector needs from a map that outlives it; map_file.hpp has the one on disk. Places
/// are numbered from 0: first those of earlier sessions, by session and frame, then each frame that
/// is added. Those of news() are numbered -1, -2, and so on. Not thread-safe.
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

  /// Throws Error (kind option) if the settings of binary_content or surf differ from the map's,
  /// because places made with other settings cannot be compared.
  virtual void check_options(const LoopDetectorOptions& options) = 0;

  /// Searches the map where its places are, if it is only read and can do so. Null otherwise.
  virtual PlaceSearch* place_search() { return nullptr; }

  /// Calls `visit` for each place of earlier sessions, in order.
  virtual void for_each_earlier_place(const Visit& visit) = 0;

  /// Calls `visit` for each loop of earlier sessions that was not rejected, in the order in which
  /// they were found.
  virtual void for_each_earlier_loop(const VisitLoop& visit) = 0;

  /// The epoch of what the two functions above visit; 0 if the map has none.
  [[nodiscard]] virtual std::int64_t epoch() { return 0; }

  /// What others added since the last call, or since what was visited: whole commits, in their
  /// order. Asked before each frame, so it should not wait.
  virtual MapNews news() { return {}; }

  /// The features of a place; empty if they are lost. Never null.
  virtual std::shared_ptr<const Features> features(PlaceId place) = 0;

  /// Stores the next frame of this session, as number detection.frame. If the detection is
  /// `unreadable`, content, features and image are empty, and only the number is stored. The image
  /// is the one the detector received and may be overwritten afterwards. Throws Error (kind output)
  /// if this frame or an earlier one could not be stored.
  virtual void add(const Detection& detection, const BinaryContent& content,
                   std::shared_ptr<const Features> features, const cv::Mat& image) = 0;

  /// Deletes a place and its features. The numbers of the others do not change. Throws Error (kind
  /// output) if the map cannot be written.
  virtual void remove(PlaceId place) = 0;

  /// Records that a loop is wrong. Session 0 is this session. Throws Error: kind option if a
  /// session does not exist, output if the map cannot be written.
  virtual void reject(const SessionFrame& query, const SessionFrame& match) = 0;
};

}  // namespace loopbit
