// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "loopbit/place_index.hpp"

namespace loopbit {

/// Collects candidates in any order, and tells ever better which places can still matter to the
/// answer. The order of candidates is: the more similar first; of equals, the earlier place.
///
/// The answer takes places in that order, and passes over those closer than `min_spacing` to one
/// taken. So each place is either taken or within min_spacing - 1 of one that is taken and before
/// it in the order. Of places at least 2 * min_spacing - 1 apart, no two can have the same one
/// near. Hence max_candidates of them, whichever they are, have as many taken places at or before
/// the last of them: what comes after that one, the floor, is not in the answer and keeps nothing
/// out of it.
class FoundPlaces {
 public:
  explicit FoundPlaces(const RetrievalOptions& options);

  /// The last candidate in the order that the answer may hold.
  [[nodiscard]] const Candidate& floor() const { return floor_; }

  /// Whether a place as similar as this, numbered `place` or later, can matter.
  [[nodiscard]] bool may_matter(double similarity, PlaceId place) const {
    return similarity > floor_.similarity ||
           (similarity == floor_.similarity && place <= floor_.place);
  }

  /// Whether overlap / larger_count is certainly below the floor; quicker than dividing.
  [[nodiscard]] bool is_below_floor(int overlap, int larger_count) const {
    constexpr double kRoundingMargin = 1.0 - 1e-12;
    return overlap < floor_.similarity * kRoundingMargin * larger_count;
  }

  /// Takes note of a candidate that may matter. Cost: linear in max_candidates.
  void add(const Candidate& candidate);

  /// The best max_candidates that are min_spacing apart, of all that were added.
  [[nodiscard]] std::vector<Candidate> answer() &&;

 private:
  void raise_floor(const Candidate& candidate);

  std::size_t max_candidates_;
  int min_spacing_;
  Candidate floor_;
  std::vector<Candidate> found_;
  std::vector<Candidate> apart_;  ///< of those found, 2 * min_spacing - 1 apart
};

}  // namespace loopbit
