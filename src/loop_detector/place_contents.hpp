// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "loopbit/place_index.hpp"

#include "place_memory.hpp"

namespace loopbit {

/// The contents of a detector's places: in an index of its own or, if the map can be searched and
/// is only read, in the map.
class PlaceContents {
 public:
  /// Keeps the reference.
  explicit PlaceContents(const PlaceMemory& memory) : memory_(memory) {}

  [[nodiscard]] PlaceId size() const {
    return memory_.is_searched() ? memory_.session_begin() : index_.size();
  }

  [[nodiscard]] BinaryContent content(PlaceId place) const {
    return memory_.is_searched() ? memory_.searched_content(place) : index_.content(place);
  }

  /// See PlaceIndex::query().
  [[nodiscard]] std::vector<Candidate> query(const BinaryContent& content, PlaceId end,
                                             const RetrievalOptions& options,
                                             const PlaceTest& is_allowed = {}) const;

  // Not of a map that is searched.

  void reserve_next() { index_.reserve_next(); }
  PlaceId add(const BinaryContent& content) { return index_.add(content); }

 private:
  const PlaceMemory& memory_;
  PlaceIndex index_;
};

}  // namespace loopbit
