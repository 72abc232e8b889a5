// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "loopbit/map_storage.hpp"
#include "loopbit/place_index.hpp"

namespace loopbit {

/// What a detector knows of its places beside their contents: their features, in memory or in a
/// map, and for those of earlier sessions where they came from.
class PlaceMemory {
 public:
  /// `map`: null = all in memory.
  explicit PlaceMemory(std::shared_ptr<MapStorage> map) : map_(std::move(map)) {}

  /// Calls visit(content) with each place of earlier sessions, in order; it returns whether the
  /// place changed the view.
  template <typename Visit>
  void restore(const Visit& visit) {
    if (!map_) return;
    map_->for_each_earlier_place([&](const SessionFrame& at, const BinaryContent& content) {
      add_earlier(at, visit(content));
    });
  }

  /// The first place of this session.
  [[nodiscard]] PlaceId session_begin() const { return static_cast<PlaceId>(earlier_.size()); }

  /// Changes of view in earlier sessions.
  [[nodiscard]] std::ptrdiff_t earlier_steps() const { return earlier_steps_; }

  /// The two below: place < session_begin().
  [[nodiscard]] const SessionFrame& origin(PlaceId place) const {
    return earlier_[static_cast<std::size_t>(place)].origin;
  }
  /// Where along the paths of all sessions it lies, counted in changes of view: negative, and far
  /// from any step of another session.
  [[nodiscard]] std::ptrdiff_t step_of(PlaceId place) const;

  /// Throws as MapStorage::add does, and stays as it was.
  void add(const Detection& detection, const BinaryContent& content, Features features);

  /// Valid until release().
  [[nodiscard]] const Features& features(PlaceId place) const;

  /// Lets go of what features() gave.
  void release() const { held_.clear(); }

 private:
  struct EarlierPlace {
    SessionFrame origin;
    int step = 0;
  };

  void add_earlier(const SessionFrame& origin, bool is_step);

  std::shared_ptr<MapStorage> map_;
  std::vector<EarlierPlace> earlier_;
  std::ptrdiff_t earlier_steps_ = 0;
  std::vector<Features> features_;  ///< without a map: of each place
  mutable std::vector<std::shared_ptr<const Features>> held_;
};

}  // namespace loopbit
