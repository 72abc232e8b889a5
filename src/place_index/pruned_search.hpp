// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "loopbit/kernels.hpp"
#include "loopbit/place_index.hpp"

#include "block_counts.hpp"
#include "found_places.hpp"
#include "place_store.hpp"

namespace loopbit {

/// One query: the exact answer of a full scan, from as few places as true bounds allow.
///
/// With a the block counts of a shifted query and b the maxima over a stretch of places,
/// sum of min(a, b) is no less than the overlap with any of these places, and
/// max(|query|, smallest |O| of the stretch) no more than any of their denominators: their quotient
/// bounds xi, rounding included, as division rounds monotonically. For several shifts at once, a is
/// the maximum of their block counts. A stretch whose bound cannot matter is left with all in it.
class PrunedSearch {
 public:
  /// Searches the first `end` places, at most store.size(). `query` is not empty.
  PrunedSearch(const PlaceStore& store, PlaceId end, const BinaryContent& query,
               const RetrievalOptions& options, const Kernels& kernels);

  [[nodiscard]] std::vector<Candidate> run();

  /// What run() looked at.
  [[nodiscard]] const RetrievalWork& work() const { return work_; }

 private:
  struct Stretch {
    double bound;  ///< of xi
    std::uint32_t number;
  };

  void prepare_shifts(const BinaryContent& query, int tolerance_columns);
  [[nodiscard]] bool may_matter(std::size_t level, const Stretch& stretch) const {
    const std::size_t first = std::size_t{stretch.number} << kStretchBits[level];
    return found_.may_matter(stretch.bound, static_cast<PlaceId>(first));
  }
  void bound_run(std::size_t level, std::size_t first, std::size_t last,
                 std::vector<Stretch>& kept);
  void bound_single_shifts(std::size_t level, std::uint32_t number, const BlockCounts& maxima,
                           int larger_count, std::vector<Stretch>& kept);
  void bound_children(std::size_t level, std::span<const Stretch> parents,
                      std::vector<Stretch>& kept);
  void descend(std::size_t level, std::span<Stretch> stretches);
  static std::vector<Stretch> take_best(std::vector<Stretch>& stretches, std::size_t wanted);
  void search_inside(const std::vector<Stretch>& coarse);
  void search_best_first(std::size_t level, std::vector<Stretch> stretches);
  void search_rest();
  void compare_stretch(std::size_t number);
  void compare_place(std::size_t place);
  void consider(std::size_t place, int overlap);
  [[nodiscard]] bool is_within_limits(std::size_t place) const;

  const PlaceStore& store_;
  const Kernels& kernels_;
  RetrievalOptions options_;
  std::size_t end_;
  int query_count_;
  cv::Point2d query_center_;
  std::vector<BinaryContent> shifted_;     ///< the query at each shift
  std::vector<BlockCounts> shift_counts_;  ///< of shifted_
  std::vector<std::uint16_t> shift_sums_;  ///< scratch, by shift
  std::vector<BlockCounts> group_counts_;  ///< for each group of neighbouring shifts, the maxima
  FoundPlaces found_;
  std::array<std::vector<Stretch>, kStretchPlaces.size()> children_;  ///< scratch, by level
  RetrievalWork work_;
};

}  // namespace loopbit
