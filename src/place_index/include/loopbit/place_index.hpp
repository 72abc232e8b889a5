// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "loopbit/binary_content.hpp"
#include "loopbit/options.hpp"

namespace loopbit {

/// Number of a place in its map: 0, 1, 2, ... in the order of adding.
using PlaceId = std::int32_t;

/// A place that looks like the query.
struct Candidate {
  PlaceId place = 0;
  double similarity = 0;  ///< xi, the maximum over the tolerated shifts, in (0, 1]

  bool operator==(const Candidate&) const = default;

  /// The order of candidates: the more similar first; of equals, the earlier place.
  [[nodiscard]] bool comes_before(const Candidate& other) const {
    return similarity != other.similarity ? similarity > other.similarity : place < other.place;
  }
};

/// Upper bound of the distance between two centres M of contents, px.
inline constexpr double kMaxCenterDistance_px = 90.0;

/// Upper limit of RetrievalOptions::max_candidates.
inline constexpr int kMaxCandidates = 1000;

struct RetrievalOptions {
  int max_candidates = 30;
  double min_similarity = 0.2;
  int shift_tolerance_columns = 4;
  int min_spacing = 3;
  double max_center_distance_px = kMaxCenterDistance_px;

  static constexpr auto fields() {
    using S = RetrievalOptions;
    return std::tuple{
        Field{"max_candidates", &S::max_candidates, 1, kMaxCandidates,
              "similar places that are verified"},
        Field{"min_similarity", &S::min_similarity, 0.0, 1.0,
              "smallest similarity xi of a candidate; 0 accepts every place that shares a pixel"},
        Field{"shift_tolerance_columns", &S::shift_tolerance_columns, 0, 32,
              "contents are compared at shifts of up to this many of 64 columns, in steps of 2"},
        Field{"min_spacing", &S::min_spacing, 1, 1000,
              "smallest distance between candidates, in places"},
        Field{"max_center_distance_px", &S::max_center_distance_px, 0.0, kMaxCenterDistance_px,
              "largest distance between the centres M of candidate and query, px; 90 = no limit"}};
  }
};

/// Whether a place may be in an answer; empty = all places may.
using PlaceTest = std::function<bool(PlaceId)>;

/// The work of one query.
struct RetrievalWork {
  std::int64_t coarse_stretches = 0;  ///< stretches of 32 consecutive places with coarse bounds
  /// Stretches of 32, 16, 8 and 2 consecutive places whose finer bounds were computed.
  std::array<std::int64_t, 4> stretches{};
  std::int64_t contents = 0;  ///< places whose contents were compared
};

class PlaceStore;

/// Stores the binary contents of all places, and finds those most similar to a query.
///
/// One thread may add while any number of other threads query. A query sees the places that existed
/// when it began; contents never move. Memory: 610 bytes per place, 512 of them its content.
class PlaceIndex {
 public:
  /// Keeps everything in memory.
  PlaceIndex();
  /// Keeps the contents in an unnamed, memory-mapped file in `scratch_folder`. The bounds stay in
  /// memory, 98 bytes per place. The file disappears with the index. Throws Error (kind output) if
  /// it cannot be created.
  explicit PlaceIndex(const std::string& scratch_folder);
  ~PlaceIndex();
  PlaceIndex(const PlaceIndex&) = delete;
  PlaceIndex& operator=(const PlaceIndex&) = delete;
  /// A moved-from index may only be assigned to or destroyed.
  PlaceIndex(PlaceIndex&&) noexcept;
  PlaceIndex& operator=(PlaceIndex&&) noexcept;

  /// Adds a place and returns its number. Amortised constant time; see add_p99_us of
  /// bench_retrieval. Throws Error (kind output), and stays as it was, if the disk that holds the
  /// contents is full.
  PlaceId add(const BinaryContent& content);

  /// Allocates the memory for the next place, so that the next add() does not throw. For callers
  /// that update other state atomically. Throws as add() does.
  void reserve_next();

  [[nodiscard]] PlaceId size() const;

  /// Valid for the lifetime of the index. Throws std::out_of_range unless 0 <= place < size().
  [[nodiscard]] const BinaryContent& content(PlaceId place) const;

  /// The most similar places among those numbered below `end`, best first; of equal ones, the
  /// earlier place first. Similarity is xi (Wang et al. 2019, section III-B), the maximum over all
  /// shifts of the query within the tolerance; |O1| and |O2| are counted before shifting. Going
  /// down this order, a place is skipped if it is closer than `min_spacing` to one already taken,
  /// or its centre is beyond the limit. The result equals that of a full scan. Empty
  /// contents neither match nor are matched. Cost: bounds of all stretches, and the contents that
  /// they cannot exclude; see docs/retrieval.md. `work`, if not null, receives the amount of work.
  /// Places that `is_allowed` refuses are left out as if they did not exist. It is called only for
  /// places that would otherwise matter, but for all of them if it refuses nearly all.
  [[nodiscard]] std::vector<Candidate> query(const BinaryContent& content, PlaceId end,
                                             const RetrievalOptions& options = {},
                                             RetrievalWork* work = nullptr,
                                             const PlaceTest& is_allowed = {}) const;

 private:
  std::unique_ptr<PlaceStore> store_;
};

}  // namespace loopbit
