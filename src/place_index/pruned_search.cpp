// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "pruned_search.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace loopbit {
namespace {

/// Shifts are bounded one by one up to so many; beyond, neighbours together.
constexpr std::size_t kMaxShiftGroups = 16;

/// Groups of coarsest stretches that one call of a kernel bounds; they lie in one chunk.
constexpr std::size_t kGroupRun = 16;
/// Finer stretches that one call bounds at most.
constexpr std::size_t kRun = 16;

/// So many groups of the largest sums go first, then kBatchGrowth times as many, and so on.
constexpr std::size_t kFirstBatch = 8;
constexpr std::size_t kBatchGrowth = 8;
/// So many coarsest stretches are descended into together; where there are no more, fewer.
constexpr std::size_t kSlice = 128;
constexpr std::size_t kSliceOfFew = 4;

/// Memory is asked for so many stretches ahead of its use.
constexpr std::size_t kAhead = 4;

constexpr std::size_t kFinestPlaces = kStretchPlaces[kFinestLevel];

void prefetch(const void* begin, std::size_t size_bytes) {
  constexpr std::size_t kLine_bytes = 64;
  const auto* bytes = static_cast<const char*>(begin);
  for (std::size_t at = 0; at < size_bytes; at += kLine_bytes) __builtin_prefetch(bytes + at);
}

}  // namespace

PrunedSearch::PrunedSearch(const PlaceStore& store, PlaceId end, const BinaryContent& query,
                           const RetrievalOptions& options, const Kernels& kernels)
    : store_(store),
      kernels_(kernels),
      options_(options),
      end_(static_cast<std::size_t>(end)),
      num_groups_(end_ / kGroupPlaces),
      query_count_(static_cast<std::uint16_t>(count(query))),
      query_center_(center(query)),
      found_(options) {
  prepare_shifts(query, options.shift_tolerance_columns);
  all_shifts_ = static_cast<std::uint16_t>((1U << group_counts_.size()) - 1);
  coarse_sums_ = std::make_unique_for_overwrite<std::uint16_t[]>(num_groups_ * kInterleaved);
  selected_ = std::make_unique_for_overwrite<std::uint32_t[]>(num_groups_ * kInterleaved);
  largest_sums_ = std::make_unique_for_overwrite<std::uint16_t[]>(num_groups_);
}

void PrunedSearch::prepare_shifts(const BinaryContent& query, int tolerance_columns) {
  const std::size_t shifts = 2 * static_cast<std::size_t>(tolerance_columns) + 1;
  shifts_per_group_ = (shifts + kMaxShiftGroups - 1) / kMaxShiftGroups;
  shifted_.reserve(shifts);
  for (int columns = -tolerance_columns; columns <= tolerance_columns; ++columns) {
    if (shifted_.size() % shifts_per_group_ == 0) {
      group_counts_.emplace_back();
      coarse_counts_.emplace_back();
    }
    shifted_.push_back(shift_columns(query, columns));
    const BlockCounts counts = block_counts(shifted_.back());
    raise(group_counts_.back(), counts);
    raise(coarse_counts_.back(), coarse_counts(counts));
  }
}

std::vector<Candidate> PrunedSearch::run() {
  bound_coarse_stretches();
  search_coarse_stretches();
  search_tail();
  return std::move(found_).answer();
}

/// Searches the places behind the last whole group of coarsest stretches.
void PrunedSearch::search_tail() {
  std::size_t searched = num_groups_ * kGroupPlaces;
  for (std::size_t level = 1; level <= kFinestLevel; ++level) {
    const std::size_t last = end_ / kStretchPlaces[level] / 2 * 2;
    std::vector<Stretch> stretches;
    for (std::size_t first = searched / kStretchPlaces[level]; first < last; first += kRun) {
      bound_run(level, first, std::min(first + kRun, last), all_shifts_, stretches);
    }
    descend(level, stretches);
    searched = last * kStretchPlaces[level];
  }
  for (; searched < end_; ++searched) compare_place(searched);
}

void PrunedSearch::bound_coarse_stretches() {
  const std::size_t shift_groups = coarse_counts_.size();
  for (std::size_t first = 0; first < num_groups_; first += kGroupRun) {
    const std::size_t groups = std::min(kGroupRun, num_groups_ - first);
    kernels_.largest_coarse_sums(coarse_counts_.front().of.data(), shift_groups,
                                 store_.coarse_group(first)->of.data(), groups,
                                 &coarse_sums_[first * kInterleaved], &largest_sums_[first]);
  }
  work_.stretches[0] = static_cast<std::int64_t>(num_groups_ * kInterleaved);
}

/// Searches the coarsest stretches, those of large sums first, so that the floor soon rises above
/// the bounds of the rest. Batches by sum, each in the order of places, take less time than sorting
/// all.
void PrunedSearch::search_coarse_stretches() {
  constexpr std::size_t kMaxSum = std::size_t{kContentSide} * kContentSide;
  constexpr std::size_t kSumsPerBucket = 4;
  std::array<std::uint32_t, kMaxSum / kSumsPerBucket + 1> sizes{};
  for (std::size_t i = 0; i < num_groups_; ++i) ++sizes[largest_sums_[i] / kSumsPerBucket];

  std::size_t wanted = kFirstBatch;
  for (std::size_t end = sizes.size(); end > 0; wanted *= kBatchGrowth) {
    const std::size_t upper_sum = end * kSumsPerBucket;
    if (static_cast<int>(upper_sum) <= found_.least_overlap(query_count_)) return;
    for (std::size_t got = 0; end > 0 && got < wanted;) got += sizes[--end];
    search_sums_between(end * kSumsPerBucket, upper_sum);
  }
}

/// Searches the coarsest stretches whose sums are at least `lower` and below `upper`.
void PrunedSearch::search_sums_between(std::size_t lower, std::size_t upper) {
  const auto least = static_cast<std::size_t>(std::max(1, found_.least_overlap(query_count_)));
  const std::size_t selected =
      kernels_.select_sums(coarse_sums_.get(), num_groups_ * kInterleaved,
                           static_cast<std::uint16_t>(std::max(lower, least)),
                           static_cast<std::uint16_t>(upper), selected_.get());
  std::vector<Stretch>& stretches = children_.front();
  stretches.clear();
  stretches.reserve(selected);
  for (std::size_t i = 0; i < selected; ++i) {
    const std::uint32_t number = selected_[i];
    stretches.push_back({number, coarse_sums_[number],
                         larger_count(*store_.smallest_counts(0, number)), all_shifts_});
  }
  // Few are worth sorting: the best of them raise the floor for the others.
  const bool are_few = selected <= kSlice;
  if (are_few) {
    std::sort(stretches.begin(), stretches.end(),
              [](const Stretch& a, const Stretch& b) { return a.sum > b.sum; });
  }
  const std::size_t slice = are_few ? kSliceOfFew : kSlice;
  const std::span<const Stretch> all = stretches;
  for (std::size_t first = 0; first < selected; first += slice) {
    descend(0, all.subspan(first, std::min(slice, selected - first)));
  }
}

/// Searches stretches down to their places.
void PrunedSearch::descend(std::size_t level, std::span<const Stretch> stretches) {
  if (level < kFinestLevel) {
    std::vector<Stretch>& children = children_[level + 1];
    children.clear();
    bound_children(level, stretches, children);
    descend(level + 1, children);
    return;
  }
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    if (i + kAhead < stretches.size()) {
      prefetch(&store_.content(stretches[i + kAhead].number * kFinestPlaces),
               kFinestPlaces * sizeof(BinaryContent));
    }
    if (may_matter(level, stretches[i])) compare_stretch(stretches[i]);
  }
}

/// Appends to `kept` the stretches of the next level within `parents` that may matter.
void PrunedSearch::bound_children(std::size_t level, std::span<const Stretch> parents,
                                  std::vector<Stretch>& kept) {
  const std::size_t children = kStretchPlaces[level] / kStretchPlaces[level + 1];
  for (std::size_t i = 0; i < parents.size(); ++i) {
    if (i + kAhead < parents.size()) {
      const std::size_t first = parents[i + kAhead].number * children;
      prefetch(store_.maxima(level + 1, first), children / 2 * sizeof(BlockPair));
      prefetch(store_.smallest_counts(level + 1, first), 1);
    }
    if (!may_matter(level, parents[i])) continue;
    const std::size_t first = parents[i].number * children;
    bound_run(level + 1, first, first + children, parents[i].shifts, kept);
  }
}

/// Bounds the stretches first to last - 1, at most kRun, of one chunk, at some of the shifts, and
/// appends to `kept` those that may matter.
void PrunedSearch::bound_run(std::size_t level, std::size_t first, std::size_t last,
                             std::uint16_t shifts, std::vector<Stretch>& kept) {
  const std::size_t run = last - first;
  const std::uint16_t* smallest = store_.smallest_counts(level, first);
  std::array<std::uint16_t, kRun> least{};
  std::array<Reached, kRun> reached;  // NOLINT: written to before it is read
  for (std::size_t i = 0; i < run; ++i) {
    const int needed = found_.least_overlap(larger_count(smallest[i]));
    least[i] = static_cast<std::uint16_t>(std::max(1, needed));
  }
  kernels_.reaching_queries(group_counts_.front().of.data(), shifts,
                            store_.maxima(level, first)->of.data(), run / 2, least.data(),
                            reached.data());
  work_.stretches[level] += static_cast<std::int64_t>(run);
  for (std::size_t i = 0; i < run; ++i) {
    const auto [sum, reaching] = reached[i];
    if (reaching == 0) continue;
    const Stretch stretch{static_cast<std::uint32_t>(first + i), sum, larger_count(smallest[i]),
                          reaching};
    if (sum > least[i] || may_matter(level, stretch)) kept.push_back(stretch);
  }
}

/// Compares the contents of a finest stretch with the query at the shifts that may matter.
void PrunedSearch::compare_stretch(const Stretch& stretch) {
  const std::size_t first = stretch.number * kFinestPlaces;
  std::array<std::uint16_t, kFinestPlaces> best{};
  for (unsigned left = stretch.shifts; left != 0; left &= left - 1) {
    const std::size_t shift = static_cast<std::size_t>(std::countr_zero(left)) * shifts_per_group_;
    std::array<std::uint16_t, kFinestPlaces> overlaps{};
    kernels_.max_overlaps(shifted_[shift].rows.data(),
                          std::min(shifts_per_group_, shifted_.size() - shift),
                          store_.content(first).rows.data(), kFinestPlaces, overlaps.data());
    for (std::size_t i = 0; i < kFinestPlaces; ++i) best[i] = std::max(best[i], overlaps[i]);
  }
  work_.contents += std::int64_t{kFinestPlaces};
  for (std::size_t i = 0; i < kFinestPlaces; ++i) consider(first + i, best[i]);
}

void PrunedSearch::compare_place(std::size_t place) {
  std::uint16_t overlap = 0;
  kernels_.max_overlaps(shifted_.front().rows.data(), shifted_.size(),
                        store_.content(place).rows.data(), 1, &overlap);
  ++work_.contents;
  consider(place, overlap);
}

void PrunedSearch::consider(std::size_t place, int overlap) {
  if (overlap == 0) return;
  const double xi = static_cast<double>(overlap) / std::max<int>(query_count_, store_.count(place));
  const Candidate candidate{static_cast<PlaceId>(place), xi};
  if (found_.may_matter(xi, candidate.place) && is_within_limits(place)) found_.add(candidate);
}

bool PrunedSearch::is_within_limits(std::size_t place) const {
  if (std::abs(query_count_ - store_.count(place)) > options_.max_count_difference) return false;
  // Within the map no two points are farther apart than this: there is no limit to look after.
  if (options_.max_center_distance_px >= kMaxCenterDistance_px) return true;
  const cv::Point2d apart = center(store_.content(place)) - query_center_;
  return std::hypot(apart.x, apart.y) <= options_.max_center_distance_px;
}

}  // namespace loopbit
