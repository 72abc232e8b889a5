// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "loopbit/place_index.hpp"

#include "place_memory.hpp"

namespace loopbit {

/// The contents of a detector's places: in an index of its own or, if the map can be searched and
/// is only read, in the map. Those that other robots added have negative numbers, as in
/// PlaceMemory.
class PlaceContents {
 public:
  /// Keeps the reference.
  explicit PlaceContents(const PlaceMemory& memory) : memory_(memory) {}

  /// Without those of other robots.
  [[nodiscard]] PlaceId size() const {
    return memory_.is_searched() ? memory_.session_begin() : index_.size();
  }

  /// Whether there are places before `end`, or of other robots.
  [[nodiscard]] bool any_before(PlaceId end) const { return end > 0 || new_index_.size() > 0; }

  [[nodiscard]] BinaryContent content(PlaceId place) const {
    if (place < 0) return new_index_.content(-1 - place);
    return memory_.is_searched() ? memory_.searched_content(place) : index_.content(place);
  }

  /// As PlaceIndex::query(); of places that are equally similar, those of other robots come last.
  [[nodiscard]] std::vector<Candidate> query(const BinaryContent& content, PlaceId end,
                                             const RetrievalOptions& options,
                                             const PlaceTest& is_allowed = {}) const;

  /// A place of another robot.
  void add_new(const BinaryContent& content) { new_index_.add(content); }

  // Not of a map that is searched.

  void reserve_next() { index_.reserve_next(); }
  PlaceId add(const BinaryContent& content) { return index_.add(content); }

 private:
  [[nodiscard]] std::vector<Candidate> query_map(const BinaryContent& content, PlaceId end,
                                                 const RetrievalOptions& options,
                                                 const PlaceTest& is_allowed) const;

  const PlaceMemory& memory_;
  PlaceIndex index_;
  PlaceIndex new_index_;  ///< of place -1 - k at k
};

}  // namespace loopbit
