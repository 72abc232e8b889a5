// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "loopbit/loop_detector.hpp"
#include "loopbit/place_index.hpp"

#include "distinctness.hpp"
#include "places.hpp"

namespace loopbit {

/// Which places may be candidates: none that was removed, none that a rejected loop of the present
/// view led to, and none that the caller leaves out.
class CandidateFilter {
 public:
  /// Keeps the reference.
  explicit CandidateFilter(const Places& places) : places_(places) {}

  void remove(PlaceId place);

  [[nodiscard]] bool is_removed(PlaceId place) const;

  /// Leaves out what shows the same place as `place` until the view changes.
  void reject(PlaceId place) { rejected_.push_back(places_.spot_of(place)); }

  void note_change_of_view() { rejected_.clear(); }

  /// For one frame; empty = all places. `changes_view`: the frame shows another view than the ones
  /// before. Valid as long as `allowed`.
  [[nodiscard]] PlaceTest test(const AllowedPlaces& allowed, bool changes_view) const;

 private:
  [[nodiscard]] PlaceTest wanted(const AllowedPlaces& allowed) const;
  [[nodiscard]] bool is_rejected(PlaceId place) const;

  const Places& places_;
  std::vector<bool> removed_;   ///< by place; those beyond are not
  std::vector<Spot> rejected_;  ///< where the present view is not
};

}  // namespace loopbit
