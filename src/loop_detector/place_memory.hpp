// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "loopbit/map_storage.hpp"
#include "loopbit/place_index.hpp"

namespace loopbit {

/// What a detector knows of its places beside their contents: their features, in memory or in a
/// map, and for those of earlier sessions where they came from.
class PlaceMemory {
 public:
  /// Keeps features valid that were read from a map.
  using Held = std::vector<std::shared_ptr<const Features>>;

  /// `map`: null = all in memory.
  explicit PlaceMemory(std::shared_ptr<MapStorage> map)
      : map_(std::move(map)), search_(map_ ? map_->place_search() : nullptr) {}

  /// Throws Error (kind option) if the map's places were made with other settings.
  void check_options(const LoopDetectorOptions& options) const {
    if (map_) map_->check_options(options);
  }

  /// Calls visit(content) with each place of earlier sessions, in order; it returns whether the
  /// place changed the view.
  template <typename Visit>
  void restore(const Visit& visit) {
    if (!map_) return;
    map_->for_each_earlier_place([&](const SessionFrame& at, const BinaryContent& content) {
      add_earlier(at, visit(content));
    });
  }

  /// Whether the map is searched in place of an index of its contents.
  [[nodiscard]] bool is_searched() const { return search_ != nullptr; }

  /// In place of restore(), of a map that is searched; see PlaceSearch.
  void restore_searched(double unmoved) {
    search_->for_each_place(
        unmoved, [&](const SessionFrame& at, bool is_step) { add_earlier(at, is_step); });
  }

  /// Several threads may ask at once.
  [[nodiscard]] PlaceSearch::Similar most_similar(const BinaryContent& content,
                                                  int shift_tolerance_columns,
                                                  std::size_t number) const {
    const std::scoped_lock lock(map_mutex_);
    return search_->most_similar(content, shift_tolerance_columns, number);
  }
  [[nodiscard]] BinaryContent searched_content(PlaceId place) const {
    const std::scoped_lock lock(map_mutex_);
    return search_->content(place);
  }

  /// Calls visit(step, earlier_step) with each loop between places restored.
  template <typename Visit>
  void restore_loops(const Visit& visit) {
    if (!map_) return;
    map_->for_each_earlier_loop([&](const SessionFrame& query, const SessionFrame& match) {
      const auto place = find(query);
      const auto earlier_place = find(match);
      if (place && earlier_place) visit(step_of(*place), step_of(*earlier_place));
    });
  }

  /// The epoch of the places restored.
  [[nodiscard]] std::int64_t epoch() const { return map_ ? map_->epoch() : 0; }

  /// See MapStorage.
  [[nodiscard]] MapNews news() const { return map_ ? map_->news() : MapNews{}; }

  /// The place of news() before this one that changed the view in the same session, if there is
  /// one.
  [[nodiscard]] std::optional<PlaceId> latest_step(int session) const;

  /// Gives the next negative number to a place of news(). `is_step`: it changed the view.
  void add_new(const SessionFrame& origin, bool is_step);

  /// The first place of this session.
  [[nodiscard]] PlaceId session_begin() const { return static_cast<PlaceId>(earlier_.size()); }

  /// Changes of view in other sessions.
  [[nodiscard]] std::ptrdiff_t earlier_steps() const { return earlier_steps_; }

  /// The three below: place < session_begin().
  [[nodiscard]] const SessionFrame& origin(PlaceId place) const {
    return place < 0 ? new_place(place).origin : earlier_[static_cast<std::size_t>(place)].origin;
  }
  /// Where along the paths of all sessions it lies, counted in changes of view: negative, and far
  /// from any step of another session.
  [[nodiscard]] std::ptrdiff_t step_of(PlaceId place) const;
  /// The same, counted from the first place of its session that is left, or of news() from the
  /// first that was news. Logarithmic.
  [[nodiscard]] std::ptrdiff_t steps_into_session(PlaceId place) const;
  /// The reverse: the first place of a step, if another session has it. Logarithmic.
  [[nodiscard]] std::optional<PlaceId> place_of(std::ptrdiff_t step) const;

  /// Throws as MapStorage::add does, and stays as it was.
  void add(const Detection& detection, const BinaryContent& content, Features features,
           const cv::Mat& image);

  /// Forgets a place, in the map, too. `is_in_view`: its features can be asked for until
  /// leave_behind() lets them go. Throws as MapStorage::remove does, and stays as it was.
  void remove(PlaceId place, bool is_in_view);

  /// Lets go of the features of removed places for which `is_in_view(place)` is false.
  template <typename IsInView>
  void leave_behind(const IsInView& is_in_view) {
    std::erase_if(removed_, [&](const auto& removed) { return !is_in_view(removed.first); });
  }

  /// Does nothing without a map. Throws as MapStorage::reject does.
  void reject(const SessionFrame& query, const SessionFrame& match) {
    if (map_) map_->reject(query, match);
  }

  /// The place of another session's frame, if the map still has it.
  [[nodiscard]] std::optional<PlaceId> find(const SessionFrame& origin) const;

  /// Valid as long as `held`. Several threads may ask at once.
  [[nodiscard]] const Features& features(PlaceId place, Held& held) const;

 private:
  struct EarlierPlace {
    SessionFrame origin;
    int step = 0;
  };

  struct NewPlace {
    SessionFrame origin;
    std::ptrdiff_t step = 0;
  };

  /// A session's places of news(), in order of their frames.
  struct NewSession {
    std::ptrdiff_t first_step = 0;
    std::vector<PlaceId> places = {};
    std::vector<PlaceId> steps = {};  ///< those that changed the view
  };

  void add_earlier(const SessionFrame& origin, bool is_step);
  [[nodiscard]] const NewPlace& new_place(PlaceId place) const {
    return new_[static_cast<std::size_t>(-(place + 1))];
  }
  [[nodiscard]] std::optional<PlaceId> find_new(const SessionFrame& origin) const;

  std::shared_ptr<MapStorage> map_;
  PlaceSearch* search_;  ///< the map's; may be null
  std::vector<EarlierPlace> earlier_;
  std::vector<NewPlace> new_;  ///< place -1 comes first
  std::map<int, NewSession> new_sessions_;
  std::map<std::ptrdiff_t, const NewSession*> by_first_step_;
  std::ptrdiff_t earlier_steps_ = 0;
  std::vector<Features> features_;                              ///< without a map: of each place
  std::map<PlaceId, std::shared_ptr<const Features>> removed_;  ///< those still in view
  mutable std::mutex map_mutex_;  ///< a map serves one thread at a time
};

}  // namespace loopbit
