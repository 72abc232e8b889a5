// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "loopbit/place_index.hpp"

#include "block_counts.hpp"
#include "bound_kernels.hpp"
#include "found_places.hpp"
#include "place_store.hpp"
#include "query_shifts.hpp"
#include "stretch_queue.hpp"

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
               const RetrievalOptions& options, InstructionSet instruction_set,
               PlaceTest is_allowed = {});

  [[nodiscard]] std::vector<Candidate> run();

  /// What run() looked at.
  [[nodiscard]] const RetrievalWork& work() const { return work_; }

 private:
  /// Finer stretches that one call of a kernel bounds at most.
  static constexpr std::size_t kRun = 128;

  /// Stretches of one level that are bounded together.
  struct Run {
    std::array<const std::uint8_t*, kRun> maxima;
    std::array<std::uint32_t, kRun> numbers;
    std::array<std::uint16_t, kRun> larger_counts;
    std::array<std::uint16_t, kRun> least_sums;  ///< that may matter
    std::array<std::uint16_t, kRun / 2> shifts;  ///< of each two, which share them
    std::size_t size = 0;
  };

  [[nodiscard]] bool may_matter(std::size_t level, const Stretch& stretch) const {
    const std::size_t first = std::size_t{stretch.number} << kStretchBits[level];
    return found_.may_matter(stretch.sum, stretch.larger_count, static_cast<PlaceId>(first));
  }
  [[nodiscard]] std::uint16_t larger_count(std::uint16_t count) const {
    return std::max(query_count_, count);
  }
  void bound_tail();
  void bound_coarse_stretches();
  void search_coarse_stretches();
  void bound_sums_between(std::size_t lower, std::size_t upper);
  void search_waiting();
  void bound_children(std::size_t level);
  void compare_taken();
  void add_to_run(std::size_t level, std::size_t first, std::size_t stretches,
                  std::uint16_t shifts);
  void bound_run(std::size_t level);
  void bound_runs();
  void compare_stretch(const Stretch& stretch);
  void compare_place(std::size_t place);
  void consider(std::size_t place, int overlap);
  void compare_allowed();
  [[nodiscard]] bool are_nearly_all_refused() const;
  [[nodiscard]] bool may_be_found(PlaceId place);

  const PlaceStore& store_;
  InstructionSet instruction_set_;
  const BoundKernels& kernels_;
  RetrievalOptions options_;
  PlaceTest is_allowed_;  ///< may be empty
  std::int64_t allowed_ = 0;
  std::int64_t refused_ = 0;
  std::size_t end_;
  std::size_t num_groups_;  ///< of coarsest stretches, all of them whole
  std::uint16_t query_count_;
  cv::Point2d query_center_;
  QueryShifts shifts_;
  std::uint16_t all_shifts_;                       ///< a bit for each group of shifts
  std::unique_ptr<std::uint16_t[]> coarse_sums_;   ///< see BoundKernels::coarse_sums
  std::unique_ptr<std::uint16_t[]> largest_sums_;  ///< for each group of stretches
  FoundPlaces found_;
  StretchQueue waiting_;
  std::vector<Stretch> taken_;                   ///< from those that wait
  std::array<Run, kStretchPlaces.size()> runs_;  ///< by level
  RetrievalWork work_;
};

}  // namespace loopbit
