// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "pruned_search.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "loopbit/kernels_for.hpp"

namespace loopbit {
namespace {

/// Groups of coarsest stretches that one call of a kernel bounds; they lie in one chunk.
constexpr std::size_t kGroupRun = 128;

/// So many groups of the largest sums go first, then kBatchGrowth times as many, and so on.
constexpr std::size_t kFirstBatch = 16;
constexpr std::size_t kBatchGrowth = 8;

/// Once so many places that look alike were refused, and hardly any allowed, the allowed ones are
/// sought first: the floor does not rise, so that bounds exclude nothing.
constexpr std::int64_t kManyRefused = 1'000;
constexpr std::int64_t kRefusedPerAllowed = 32;

/// Contents are asked for so many stretches ahead of their use.
constexpr std::size_t kAhead = 4;

constexpr std::size_t kFinestPlaces = kStretchPlaces[kFinestLevel];

/// Stretches of the next level in one of `level`.
constexpr std::size_t children(std::size_t level) {
  return kStretchPlaces[level] / kStretchPlaces[level + 1];
}

constexpr std::size_t kCacheLine_bytes = 64;

/// No more than `similarity`, in steps of 1 / 65,536.
std::uint16_t floor_in_16_bits(double similarity) {
  return static_cast<std::uint16_t>(std::min(similarity * 65'536, 65'535.0));
}

/// What is asked for lies anywhere, and takes a hundred times as long as an instruction.
void prefetch(const void* begin, std::size_t size_bytes) {
  constexpr int kIntoSecondCache = 2;  // many at once would fill the queue of the first
  const auto* bytes = static_cast<const char*>(begin);
  for (std::size_t at = 0; at < size_bytes; at += kCacheLine_bytes) {
    __builtin_prefetch(bytes + at, 0, kIntoSecondCache);
  }
}

}  // namespace

PrunedSearch::PrunedSearch(const PlaceStore& store, PlaceId end, const BinaryContent& query,
                           const RetrievalOptions& options, InstructionSet instruction_set,
                           PlaceTest is_allowed)
    : store_(store),
      instruction_set_(instruction_set),
      kernels_(kernels_for<BoundKernels>(instruction_set)),
      options_(options),
      is_allowed_(std::move(is_allowed)),
      end_(static_cast<std::size_t>(end)),
      num_groups_(end_ / kGroupPlaces),
      query_count_(static_cast<std::uint16_t>(count(query))),
      query_center_(center(query)),
      shifts_(query, options.shift_tolerance_columns),
      all_shifts_(static_cast<std::uint16_t>((1U << shifts_.group_counts.size()) - 1)),
      found_(options) {
  coarse_sums_ = std::make_unique_for_overwrite<std::uint16_t[]>(num_groups_ * kInterleaved *
                                                                 shifts_.coarse_counts.size());
  largest_sums_ = std::make_unique_for_overwrite<std::uint16_t[]>(num_groups_);
}

std::vector<Candidate> PrunedSearch::run() {
  bound_coarse_stretches();
  bound_tail();
  search_coarse_stretches();
  if (are_nearly_all_refused()) compare_allowed();
  return std::move(found_).answer();
}

/// Bounds the stretches behind the last whole group of coarsest ones, and compares the places that
/// are in none.
void PrunedSearch::bound_tail() {
  std::size_t done = num_groups_ * kGroupPlaces;
  for (std::size_t level = 0; level <= kFinestLevel; ++level) {
    const std::size_t end = end_ / kStretchPlaces[level];
    for (std::size_t number = done / kStretchPlaces[level]; number < end; ++number) {
      add_to_run(level, number, 1, all_shifts_);
    }
    done = end * kStretchPlaces[level];
  }
  bound_runs();
  for (; done < end_; ++done) compare_place(done);
}

void PrunedSearch::bound_coarse_stretches() {
  const std::size_t shift_groups = shifts_.coarse_counts.size();
  for (std::size_t first = 0; first < num_groups_; first += kGroupRun) {
    const std::size_t groups = std::min(kGroupRun, num_groups_ - first);
    kernels_.coarse_sums(shifts_.coarse_counts.front().of.data(), shift_groups,
                         store_.coarse_group(first)->of.data(), groups,
                         &coarse_sums_[first * kInterleaved * shift_groups], &largest_sums_[first]);
  }
  work_.coarse_stretches = static_cast<std::int64_t>(num_groups_ * kInterleaved);
}

/// Searches all stretches, the coarsest in batches, those of large coarse sums first, so that the
/// floor soon rises above the bounds of the rest.
void PrunedSearch::search_coarse_stretches() {
  constexpr std::size_t kMaxSum = std::size_t{kContentSide} * kContentSide;
  constexpr std::size_t kSumsPerBucket = 4;
  std::array<std::uint32_t, kMaxSum / kSumsPerBucket + 1> sizes{};
  for (std::size_t i = 0; i < num_groups_; ++i) ++sizes[largest_sums_[i] / kSumsPerBucket];

  std::size_t wanted = kFirstBatch;
  for (std::size_t end = sizes.size(); end > 0; wanted *= kBatchGrowth) {
    const std::size_t upper_sum = end * kSumsPerBucket;
    if (static_cast<int>(upper_sum) <= found_.least_overlap(query_count_)) break;
    if (are_nearly_all_refused()) return;
    for (std::size_t got = 0; end > 0 && got < wanted;) got += sizes[--end];
    bound_sums_between(end * kSumsPerBucket, upper_sum);
    search_waiting();
  }
  search_waiting();
}

/// Bounds the coarsest stretches whose coarse sums are at least `lower` and below `upper`.
void PrunedSearch::bound_sums_between(std::size_t lower, std::size_t upper) {
  const auto least = static_cast<std::size_t>(std::max(1, found_.least_overlap(query_count_)));
  Selection selection{.lower = static_cast<std::uint16_t>(std::max(lower, least)),
                      .upper = static_cast<std::uint16_t>(upper),
                      .query_count = query_count_};
  const std::size_t shift_groups = shifts_.coarse_counts.size();
  std::array<Selected, kGroupRun * kInterleaved> selected;  // NOLINT: written before it is read
  for (std::size_t group = 0; group < num_groups_; group += kGroupRun) {
    const std::size_t first = group * kInterleaved;
    selection.smallest_counts = store_.smallest_counts(0, first);
    selection.floor = floor_in_16_bits(found_.floor().similarity);
    const std::size_t num_selected = kernels_.select_records(
        &coarse_sums_[first * shift_groups], &largest_sums_[group], shift_groups,
        std::min(kGroupRun, num_groups_ - group), selection, selected.data());
    for (std::size_t i = 0; i < num_selected; ++i) {
      add_to_run(0, first + selected[i].record, 1, selected[i].queries);
    }
  }
  bound_runs();
}

/// Searches what waits, down to the places.
void PrunedSearch::search_waiting() {
  for (;;) {
    const std::size_t level = waiting_.pop(found_.floor().similarity, taken_);
    if (taken_.empty()) return;
    if (level < kFinestLevel) {
      bound_children(level);
    } else {
      compare_taken();
      if (are_nearly_all_refused()) return;
    }
  }
}

/// Bounds the stretches of the next level within those that were taken.
void PrunedSearch::bound_children(std::size_t level) {
  for (const Stretch& stretch : taken_) {
    if (!may_matter(level, stretch)) continue;
    add_to_run(level + 1, stretch.number * children(level), children(level), stretch.shifts);
  }
  bound_runs();
}

/// Compares the contents of the stretches that were taken.
void PrunedSearch::compare_taken() {
  for (std::size_t i = taken_.size(); i-- > 0;) {
    if (i >= kAhead) {
      prefetch(&store_.content(taken_[i - kAhead].number * kFinestPlaces),
               kFinestPlaces * sizeof(BinaryContent));
    }
    if (may_matter(kFinestLevel, taken_[i])) compare_stretch(taken_[i]);
    if (are_nearly_all_refused()) return;
  }
}

/// Adds consecutive stretches, all of one chunk, to those that one call of a kernel bounds.
void PrunedSearch::add_to_run(std::size_t level, std::size_t first, std::size_t stretches,
                              std::uint16_t shifts) {
  Run& run = runs_[level];
  if (run.size + stretches > kRun) bound_run(level);
  const PackedCounts* maxima = store_.maxima(level, first);
  const std::uint16_t* smallest = store_.smallest_counts(level, first);
  if (level == 0) prefetch(store_.smallest_counts(1, first * children(0)), kCacheLine_bytes);
  for (std::size_t i = 0; i < stretches; ++i) {
    const std::size_t at = run.size++;
    const std::uint16_t larger = larger_count(smallest[i]);
    run.numbers[at] = static_cast<std::uint32_t>(first + i);
    run.maxima[at] = maxima[i].of.data();
    prefetch(run.maxima[at], kPackedBytes);
    run.larger_counts[at] = larger;
    run.least_sums[at] = static_cast<std::uint16_t>(std::max(1, found_.least_overlap(larger)));
    std::uint16_t& of_both = run.shifts[at / 2];
    of_both = at % 2 == 0 ? shifts : static_cast<std::uint16_t>(of_both | shifts);
  }
}

/// Bounds the stretches of a run. Of the coarsest that may matter, nearly all would be looked into
/// anyway, so their halves are at once; finer ones wait.
void PrunedSearch::bound_run(std::size_t level) {
  Run& run = runs_[level];
  if (run.size == 0) return;
  std::array<Reached, kRun> reached;  // NOLINT: written before it is read
  kernels_.reaching_queries(shifts_.group_counts.front().of.data(), run.shifts.data(),
                            run.maxima.data(), run.size, run.least_sums.data(), reached.data());
  // Which ones are kept is hard to foresee: gathering them first takes no branch.
  std::array<Stretch, kRun> kept;  // NOLINT: written before it is read
  std::size_t num_kept = 0;
  for (std::size_t i = 0; i < run.size; ++i) {
    kept[num_kept] = {run.numbers[i], reached[i].largest_sum, run.larger_counts[i],
                      reached[i].queries};
    num_kept += reached[i].queries != 0 ? 1U : 0U;
  }
  work_.stretches[level] += static_cast<std::int64_t>(run.size);
  run.size = 0;
  for (std::size_t i = 0; i < num_kept; ++i) {
    if (level == 0) {
      add_to_run(1, kept[i].number * children(0), children(0), kept[i].shifts);
    } else {
      waiting_.push(level, kept[i]);
    }
  }
}

/// Bounds what is left in the runs, and what is added to finer ones then.
void PrunedSearch::bound_runs() {
  for (std::size_t level = 0; level < runs_.size(); ++level) bound_run(level);
}

/// Compares the contents of a finest stretch with the query at the shifts that may matter.
void PrunedSearch::compare_stretch(const Stretch& stretch) {
  const std::size_t first = stretch.number * kFinestPlaces;
  std::array<std::uint16_t, kFinestPlaces> best{};
  for (unsigned left = stretch.shifts; left != 0; left &= left - 1) {
    const std::size_t shift = static_cast<std::size_t>(std::countr_zero(left)) * shifts_.per_group;
    std::array<std::uint16_t, kFinestPlaces> overlaps{};
    const std::size_t shifts = std::min(shifts_.per_group, shifts_.shifted.size() - shift);
    max_overlaps(std::span(shifts_.shifted).subspan(shift, shifts),
                 std::span(&store_.content(first), kFinestPlaces), overlaps, instruction_set_);
    for (std::size_t i = 0; i < kFinestPlaces; ++i) best[i] = std::max(best[i], overlaps[i]);
  }
  work_.contents += std::int64_t{kFinestPlaces};
  for (std::size_t i = 0; i < kFinestPlaces; ++i) consider(first + i, best[i]);
}

void PrunedSearch::compare_place(std::size_t place) {
  std::uint16_t overlap = 0;
  max_overlaps(shifts_.shifted, std::span(&store_.content(place), 1), std::span(&overlap, 1),
               instruction_set_);
  ++work_.contents;
  consider(place, overlap);
}

void PrunedSearch::consider(std::size_t place, int overlap) {
  if (overlap == 0) return;
  const double xi = static_cast<double>(overlap) / std::max<int>(query_count_, store_.count(place));
  const Candidate candidate{static_cast<PlaceId>(place), xi};
  if (found_.may_matter(xi, candidate.place) && may_be_found(candidate.place)) {
    found_.add(candidate);
  }
}

bool PrunedSearch::are_nearly_all_refused() const {
  return refused_ >= kManyRefused && refused_ >= kRefusedPerAllowed * allowed_;
}

/// Compares all places that are allowed, and no others, from the start.
void PrunedSearch::compare_allowed() {
  found_ = FoundPlaces(options_);
  const PlaceTest is_allowed = std::exchange(is_allowed_, {});
  for (std::size_t place = 0; place < end_; ++place) {
    if (is_allowed(static_cast<PlaceId>(place))) compare_place(place);
  }
}

bool PrunedSearch::may_be_found(PlaceId place) {
  if (is_allowed_ && !is_allowed_(place)) {
    ++refused_;
    return false;
  }
  ++allowed_;
  // Within the map no two points are farther apart than this: there is no limit to look after.
  if (options_.max_center_distance_px >= kMaxCenterDistance_px) return true;
  const cv::Point2d apart = center(store_.content(static_cast<std::size_t>(place))) - query_center_;
  return std::hypot(apart.x, apart.y) <= options_.max_center_distance_px;
}

}  // namespace loopbit
