// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <unordered_map>

#include "loopbit/place_index.hpp"
#include "loopbit/surf.hpp"

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

}  // namespace loopbit
