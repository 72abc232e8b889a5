// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "loopbit/detection.hpp"
#include "loopbit/map_storage.hpp"
#include "loopbit/place_index.hpp"

#include "distinctness.hpp"
#include "known_loops.hpp"
#include "place_contents.hpp"
#include "place_memory.hpp"
#include "recent_view.hpp"

namespace loopbit {

/// All places that a detector knows: those of its session, of earlier sessions in its map, and of
/// other robots that add to the map, too (these have negative numbers). A place has a content,
/// features and a step, its position along the paths of all sessions, counted in changes of view.
class Places {
 public:
  /// Reads what `map` has; null = all in memory. Throws Error (kind option) if its places were made
  /// with other settings.
  Places(const LoopDetectorOptions& options, std::shared_ptr<MapStorage> map);

  /// Takes in what other robots added to the map.
  void learn();
  /// See Detection::epoch.
  [[nodiscard]] std::int64_t epoch() const { return epoch_; }

  /// Without those of other robots.
  [[nodiscard]] PlaceId size() const { return contents_.size(); }
  /// The first place of this session.
  [[nodiscard]] PlaceId session_begin() const { return memory_.session_begin(); }

  /// The frame that shows a place, and the reverse, if there is one. Session 0 is this session.
  [[nodiscard]] SessionFrame origin(PlaceId place) const;
  [[nodiscard]] std::optional<PlaceId> find(const SessionFrame& at) const;

  [[nodiscard]] std::ptrdiff_t step_of(PlaceId place) const;
  /// The same, counted from the beginning of its session; see PlaceMemory.
  [[nodiscard]] std::ptrdiff_t steps_into_session(PlaceId place) const;
  /// The first place of a step, if there is such a step.
  [[nodiscard]] std::optional<PlaceId> place_of(std::ptrdiff_t step) const;
  [[nodiscard]] Spot spot_of(PlaceId place) const;
  /// How many steps the places below `end` have, with those of other robots.
  [[nodiscard]] std::ptrdiff_t steps_before(PlaceId end) const;

  [[nodiscard]] const PlaceContents& contents() const { return contents_; }
  /// Valid as long as `held`. Several threads may ask at once.
  [[nodiscard]] const Features& features(PlaceId place, PlaceMemory::Held& held) const {
    return memory_.features(place, held);
  }

  [[nodiscard]] const RecentView& recent_view() const { return recent_view_; }
  /// Whether the content of a new frame shows another view than the latest step.
  [[nodiscard]] bool changes_view(const BinaryContent& content) const;

  /// Adds a frame of this session. `look`: none = it shows nothing. All of it or, where it throws,
  /// nothing.
  void add(const BinaryContent& content, Features features,
           const std::optional<RecentView::Look>& look, const Detection& detection,
           const cv::Mat& image);

  /// Forgets the features of a place, in the map, too. Throws as MapStorage::remove does, and stays
  /// as it was.
  void remove(PlaceId place) { memory_.remove(place, recent_view_.is_in_view(place)); }

  /// The loops between them.
  [[nodiscard]] const KnownLoops& known_loops() const { return known_loops_; }
  [[nodiscard]] KnownLoops& known_loops() { return known_loops_; }
  /// Tells the map that a loop is wrong. Throws as MapStorage::reject does.
  void reject(const SessionFrame& query, const SessionFrame& match) {
    memory_.reject(query, match);
  }

 private:
  void restore_places();
  void restore_loops();
  [[nodiscard]] bool changes_view(const BinaryContent& content,
                                  std::optional<PlaceId> latest_step) const;

  PlaceMemory memory_;
  PlaceContents contents_;
  RecentView recent_view_;
  KnownLoops known_loops_;
  std::int64_t epoch_ = 0;  ///< of the places restored or learned
};

}  // namespace loopbit
