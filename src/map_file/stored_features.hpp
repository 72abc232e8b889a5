// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "loopbit/map_database.hpp"
#include "loopbit/place_index.hpp"
#include "loopbit/surf.hpp"

#include "map_rows.hpp"

namespace loopbit {

/// The features of recently used places, up to a number of bytes.
class FeatureCache {
 public:
  explicit FeatureCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// Null if they are not in the cache.
  std::shared_ptr<const Features> find(PlaceId place);

  /// Unchanged if memory runs out (std::bad_alloc).
  void add(PlaceId place, std::shared_ptr<const Features> features);

  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  struct Entry {
    PlaceId place;
    std::shared_ptr<const Features> features;
  };

  std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  std::list<Entry> entries_;  ///< the one used last comes first
  std::unordered_map<PlaceId, std::list<Entry>::iterator> at_;
};

/// The features of a map's places, by the detector's numbers, with a cache.
class StoredFeatures {
 public:
  explicit StoredFeatures(std::size_t cache_mb) : cache_(cache_mb << 20U) {}

  /// Call this before add(). A second call throws Error (kind option), since the places of the map
  /// at `path` are numbered for one detector.
  void begin(const std::string& path);

  /// The row of a place without features, which has none in the map.
  static constexpr std::int64_t kNoRow = 0;

  /// Allocates the memory for the next add(), so that it does not throw.
  void reserve_next() {
    if (places_.size() == places_.capacity()) places_.reserve(2 * places_.size() + 1);
  }

  /// Gives the next number to the row `id`, which is place `at`.
  void add(std::int64_t id, const SessionFrame& at) { places_.push_back({id, at}); }

  /// Gives the next negative number, from -1 on, to a row that others added.
  void add_new(std::int64_t id, const SessionFrame& at) { new_places_.push_back({id, at}); }

  /// Forgets the row of a place, and returns it.
  std::int64_t remove(PlaceId place) { return std::exchange(stored(place).id, kNoRow); }

  struct StoredPlace {
    std::int64_t id = 0;  ///< of its row, or kNoRow
    SessionFrame at;
  };

  [[nodiscard]] const StoredPlace& place(PlaceId place) { return stored(place); }

  [[nodiscard]] PlaceId size() const { return static_cast<PlaceId>(places_.size()); }

  /// Null if they would have to be read.
  std::shared_ptr<const Features> find(PlaceId place) { return cache_.find(place); }

  /// Empty, with a clause in `damage`, if they are lost. `reader`: of the database with their row.
  std::shared_ptr<const Features> get(PlaceId place, Damage& damage, FeatureReader& reader);

  void keep(PlaceId place, std::shared_ptr<const Features> features) {
    cache_.add(place, std::move(features));
  }

 private:
  [[nodiscard]] StoredPlace& stored(PlaceId place) {
    return place < 0 ? new_places_.at(static_cast<std::size_t>(-(place + 1)))
                     : places_.at(static_cast<std::size_t>(place));
  }

  bool has_begun_ = false;
  FeatureCache cache_;
  std::vector<StoredPlace> places_;
  std::vector<StoredPlace> new_places_;  ///< place -1 comes first
};

}  // namespace loopbit
