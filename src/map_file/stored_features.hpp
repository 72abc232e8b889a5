// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "loopbit/database.hpp"
#include "loopbit/place_index.hpp"
#include "loopbit/surf.hpp"

#include "map_rows.hpp"

namespace loopbit {

/// The features of the places used last, up to a number of bytes.
class FeatureCache {
 public:
  explicit FeatureCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// Null if they are not there.
  std::shared_ptr<const Features> find(PlaceId place);

  /// Stays as it was where memory is refused (std::bad_alloc).
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

/// The features of a map's places by the number a detector knows them by; those used last are kept.
class StoredFeatures {
 public:
  StoredFeatures(const Database& database, std::size_t cache_mb)
      : reader_(database), cache_(cache_mb << 20U) {}

  /// To be called before add(). Throws Error (kind option) the second time: the places of the map
  /// at `path` are numbered for one detector.
  void begin(const std::string& path);

  /// What stands for the row of a place that has none, as it has no features.
  static constexpr std::int64_t kNoRow = 0;

  /// Takes the memory that the next add() needs, so that it does not throw.
  void reserve_next() {
    if (places_.size() == places_.capacity()) places_.reserve(2 * places_.size() + 1);
  }

  /// Gives the row `id`, a place of `at`, the next number.
  void add(std::int64_t id, const SessionFrame& at) { places_.push_back({id, at}); }

  [[nodiscard]] PlaceId size() const { return static_cast<PlaceId>(places_.size()); }

  /// Null if they would have to be read.
  std::shared_ptr<const Features> find(PlaceId place) { return cache_.find(place); }

  /// Without any, and a clause in `damage`, if they are lost.
  std::shared_ptr<const Features> get(PlaceId place, Damage& damage);

  void keep(PlaceId place, std::shared_ptr<const Features> features) {
    cache_.add(place, std::move(features));
  }

 private:
  struct StoredPlace {
    std::int64_t id = 0;
    SessionFrame at;
  };

  bool has_begun_ = false;
  FeatureReader reader_;
  FeatureCache cache_;
  std::vector<StoredPlace> places_;
};

}  // namespace loopbit
