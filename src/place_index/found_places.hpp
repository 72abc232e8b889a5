// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "loopbit/place_index.hpp"

namespace loopbit {

/// Collects candidates in any order, and tells ever better which places can still matter to the
/// answer.
///
/// The answer takes places in the order of Candidate::comes_before(), and passes over those closer
/// than `min_spacing` to one taken. So each place is either taken or within min_spacing - 1 of one
/// that is taken and before it in the order. Of places at least 2 * min_spacing - 1 apart, no two
/// can have the same one near. Hence max_candidates of them, whichever they are, have as many taken
/// places at or before the last of them: what comes after that one, the floor, is not in the answer
/// and keeps nothing out of it.
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

  /// No smaller overlap can matter where max(|O1|, |O2|) is `larger_count`: their quotient is
  /// below the floor. Quicker than dividing, and at most one less than the least that can.
  [[nodiscard]] int least_overlap(int larger_count) const {
    constexpr double kNearlyOne = 1.0 - 1e-6;  // rounding is far less than what is missing
    return static_cast<int>(floor_.similarity * larger_count + kNearlyOne);
  }

  /// Whether a place with at most this overlap, numbered `place` or later, can matter.
  [[nodiscard]] bool may_matter(int overlap, int larger_count, PlaceId place) const {
    const int least = least_overlap(larger_count);
    if (overlap != least) return overlap > least;
    return may_matter(static_cast<double>(overlap) / larger_count, place);
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
