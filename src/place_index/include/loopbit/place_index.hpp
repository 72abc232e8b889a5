// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "loopbit/binary_content.hpp"
#include "loopbit/options.hpp"

namespace loopbit {

/// A place's number in its map: 0, 1, 2, ... in the order of adding.
using PlaceId = std::int32_t;

/// A place that looks like the query.
struct Candidate {
  PlaceId place = 0;
  double similarity = 0;  ///< xi, the best over the tolerated shifts, in (0, 1]

  bool operator==(const Candidate&) const = default;
};

struct RetrievalOptions {
  int max_candidates = 20;
  double min_similarity = 0.2;
  int shift_tolerance_columns = 4;
  int min_spacing = 3;

  static constexpr auto fields() {
    using S = RetrievalOptions;
    return std::tuple{
        Field{"max_candidates", &S::max_candidates, 1, 1000, "look-alike places that are verified"},
        Field{"min_similarity", &S::min_similarity, 0.0, 1.0,
              "smallest similarity xi of a candidate; 0 takes every place that shares a pixel"},
        Field{"shift_tolerance_columns", &S::shift_tolerance_columns, 0, 32,
              "the contents are compared shifted sideways by up to so many of their 64 columns"},
        Field{"min_spacing", &S::min_spacing, 1, 1000,
              "candidates are at least so many places apart"}};
  }
};

/// The binary contents of all places, and the question which of them look like a query.
/// Not thread-safe while adding; any number of threads may query at once.
class PlaceIndex {
 public:
  /// Adds a place and returns its number. Amortised constant time; 516 bytes a place.
  PlaceId add(const BinaryContent& content);

  [[nodiscard]] PlaceId size() const { return static_cast<PlaceId>(contents_.size()); }

  /// Throws std::out_of_range unless 0 <= place < size().
  [[nodiscard]] const BinaryContent& content(PlaceId place) const;

  /// The most similar places among those numbered below `end`, best first; of equals, the earlier
  /// place first. Similarity is xi (Wang et al. 2019, section III-B), the best over all shifts of
  /// the query within the tolerance; |O1| and |O2| are counted before shifting. Going down that
  /// order, a place is passed over if it lies closer than `min_spacing` to one already taken.
  /// Exact: an empty content has no candidates and is none. Cost: linear in `end`.
  [[nodiscard]] std::vector<Candidate> query(const BinaryContent& content, PlaceId end,
                                             const RetrievalOptions& options = {}) const;

 private:
  std::vector<BinaryContent> contents_;
  std::vector<int> counts_;  ///< counts_[i] = count(contents_[i])
};

}  // namespace loopbit
