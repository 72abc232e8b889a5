// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
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

/// No two centres M of contents are farther apart, px.
inline constexpr double kMaxCenterDistance_px = 90.0;

struct RetrievalOptions {
  int max_candidates = 20;
  double min_similarity = 0.2;
  int shift_tolerance_columns = 4;
  int min_spacing = 3;
  int max_count_difference = 4096;
  double max_center_distance_px = kMaxCenterDistance_px;

  static constexpr auto fields() {
    using S = RetrievalOptions;
    return std::tuple{
        Field{"max_candidates", &S::max_candidates, 1, 1000, "look-alike places that are verified"},
        Field{"min_similarity", &S::min_similarity, 0.0, 1.0,
              "smallest similarity xi of a candidate; 0 takes every place that shares a pixel"},
        Field{"shift_tolerance_columns", &S::shift_tolerance_columns, 0, 32,
              "contents are compared shifted by up to so many of 64 columns, in steps of 2"},
        Field{"min_spacing", &S::min_spacing, 1, 1000,
              "places that look alike are at least so many apart; also how far beside a followed "
              "way or the best candidate places are looked at"},
        Field{"max_count_difference", &S::max_count_difference, 0, 4096,
              "a candidate's |O| differs from the query's by at most so many pixels; 4096 = any"},
        Field{"max_center_distance_px", &S::max_center_distance_px, 0.0, kMaxCenterDistance_px,
              "a candidate's centre M lies within so many pixels of the query's; 90 = anywhere"}};
  }
};

/// What one query looked at.
struct RetrievalWork {
  std::int64_t coarse_stretches = 0;  ///< of 32 consecutive places, bounded coarsely
  /// Stretches of 32, 16, 8 and 2 consecutive places whose finer bounds were computed.
  std::array<std::int64_t, 4> stretches{};
  std::int64_t contents = 0;  ///< places whose contents were compared
};

class PlaceStore;

/// The binary contents of all places, and the question which of them look like a query.
///
/// One thread may add while any number of others ask: a query sees the places that were there when
/// it began, and contents never move. Memory: 610 bytes a place, 512 of them its content.
class PlaceIndex {
 public:
  /// All in memory.
  PlaceIndex();
  /// The contents in a file without a name in `scratch_folder`, mapped to memory, which holds what
  /// the bounds need, 98 bytes a place. The file is gone when the index is. Throws Error (kind
  /// output) if it cannot be made.
  explicit PlaceIndex(const std::string& scratch_folder);
  ~PlaceIndex();
  PlaceIndex(const PlaceIndex&) = delete;
  PlaceIndex& operator=(const PlaceIndex&) = delete;
  /// An index moved from may only be assigned to or destroyed.
  PlaceIndex(PlaceIndex&&) noexcept;
  PlaceIndex& operator=(PlaceIndex&&) noexcept;

  /// Adds a place and returns its number. Amortised constant time; see add_p99_us of
  /// bench_retrieval. Throws Error (kind output), and stays as it was, if the disk that holds the
  /// contents is full.
  PlaceId add(const BinaryContent& content);

  /// Takes the memory that the next place needs, so that the next add() does not throw: for who
  /// keeps something else in step with the places. Throws as add() does.
  void reserve_next();

  [[nodiscard]] PlaceId size() const;

  /// Valid as long as the index. Throws std::out_of_range unless 0 <= place < size().
  [[nodiscard]] const BinaryContent& content(PlaceId place) const;

  /// The most similar places among those numbered below `end`, best first; of equals, the earlier
  /// place first. Similarity is xi (Wang et al. 2019, section III-B), the best over all shifts of
  /// the query within the tolerance; |O1| and |O2| are counted before shifting. Going down that
  /// order, a place is passed over if it lies closer than `min_spacing` to one already taken, or
  /// beyond the limits of count and centre.
  /// Exact, as a full scan would answer: an empty content has no candidates and is none. Cost:
  /// bounds of stretches of the past, and a look at the places that these leave; see
  /// docs/retrieval.md. `work`, if not null, is told what was looked at.
  [[nodiscard]] std::vector<Candidate> query(const BinaryContent& content, PlaceId end,
                                             const RetrievalOptions& options = {},
                                             RetrievalWork* work = nullptr) const;

 private:
  std::unique_ptr<PlaceStore> store_;
};

}  // namespace loopbit
