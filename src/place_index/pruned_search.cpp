// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "pruned_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace loopbit {
namespace {

/// Neighbouring shifts that are bounded together first.
constexpr std::size_t kShiftsPerGroup = 3;

/// Stretches whose bounds are computed by one call of a kernel.
constexpr std::size_t kRun = 16;

/// The level whose stretches are searched best first.
constexpr std::size_t kSortedLevel = 1;
/// Of the coarsest stretches, one in so many is searched before the others are looked into.
constexpr std::size_t kCoarseToFirst = 64;
/// At kSortedLevel so many go first, then kBatchGrowth times as many, and so on.
constexpr std::size_t kFirstBatch = 8;
constexpr std::size_t kBatchGrowth = 8;
/// So many are descended into together.
constexpr std::size_t kSlice = 8;

/// Memory is asked for so many stretches ahead of its use.
constexpr std::size_t kAhead = 6;

constexpr std::size_t kFinestPlaces = kStretchPlaces[kFinestLevel];

template <typename Stretch>
bool has_larger_bound(const Stretch& a, const Stretch& b) {
  return a.bound > b.bound;
}

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
      query_count_(count(query)),
      query_center_(center(query)),
      found_(options) {
  prepare_shifts(query, options.shift_tolerance_columns);
}

void PrunedSearch::prepare_shifts(const BinaryContent& query, int tolerance_columns) {
  for (int columns = -tolerance_columns; columns <= tolerance_columns; ++columns) {
    if (shifted_.size() % kShiftsPerGroup == 0) group_counts_.emplace_back();
    shifted_.push_back(shift_columns(query, columns));
    shift_counts_.push_back(block_counts(shifted_.back()));
    raise(group_counts_.back(), shift_counts_.back());
  }
}

std::vector<Candidate> PrunedSearch::run() {
  std::vector<Stretch> coarse;
  const std::size_t whole = end_ / kStretchPlaces.front();
  for (std::size_t first = 0; first < whole; first += kRun) {
    bound_run(0, first, std::min(first + kRun, whole), coarse);
  }
  // The most promising stretches give a first floor, below which most others need no look inside.
  search_inside(take_best(coarse, 1 + coarse.size() / kCoarseToFirst));
  search_rest();
  search_inside(coarse);
  return std::move(found_).answer();
}

/// Moves the `wanted` stretches of largest bound, or all, out of `stretches`; both keep their
/// order.
std::vector<PrunedSearch::Stretch> PrunedSearch::take_best(std::vector<Stretch>& stretches,
                                                           std::size_t wanted) {
  if (stretches.size() <= wanted) return std::exchange(stretches, {});
  std::vector<Stretch> sorted = stretches;
  const auto last = sorted.begin() + static_cast<std::ptrdiff_t>(wanted) - 1;
  std::nth_element(sorted.begin(), last, sorted.end(), has_larger_bound<Stretch>);
  std::vector<Stretch> best;
  std::vector<Stretch> others;
  for (const Stretch& stretch : stretches) {
    const bool is_best = stretch.bound >= last->bound && best.size() < wanted;
    (is_best ? best : others).push_back(stretch);
  }
  stretches.swap(others);
  return best;
}

/// Searches coarsest stretches.
void PrunedSearch::search_inside(const std::vector<Stretch>& coarse) {
  std::vector<Stretch> finer;
  bound_children(0, coarse, finer);
  search_best_first(kSortedLevel, std::move(finer));
}

/// Bounds the stretches first to last - 1, at most kRun, of one chunk, and appends to `kept` those
/// that may matter: by groups of shifts, and those that are left by each shift.
void PrunedSearch::bound_run(std::size_t level, std::size_t first, std::size_t last,
                             std::vector<Stretch>& kept) {
  if (first >= last) return;
  const std::size_t run = last - first;
  const StretchBounds bounds = store_.bounds(level, first);
  std::array<std::uint16_t, kRun> overlaps;  // NOLINT: written to before it is read
  kernels_.max_min_sums(group_counts_.front().of.data(), group_counts_.size(),
                        bounds.maxima->of.data(), run, overlaps.data());
  work_.stretches[level] += static_cast<std::int64_t>(run);

  for (std::size_t i = 0; i < run; ++i) {
    const int larger = std::max<int>(query_count_, bounds.smallest_counts[i]);
    if (found_.is_below_floor(overlaps[i], larger)) continue;
    bound_single_shifts(level, static_cast<std::uint32_t>(first + i), bounds.maxima[i], larger,
                        kept);
  }
}

void PrunedSearch::bound_single_shifts(std::size_t level, std::uint32_t number,
                                       const BlockCounts& maxima, int larger_count,
                                       std::vector<Stretch>& kept) {
  std::uint16_t overlap = 0;
  kernels_.max_min_sums(shift_counts_.front().of.data(), shift_counts_.size(), maxima.of.data(), 1,
                        &overlap);
  const Stretch stretch{static_cast<double>(overlap) / larger_count, number};
  if (overlap > 0 && may_matter(level, stretch)) kept.push_back(stretch);
}

/// Appends to `kept` the stretches of the next level within `parents` that may matter.
void PrunedSearch::bound_children(std::size_t level, std::span<const Stretch> parents,
                                  std::vector<Stretch>& kept) {
  const std::size_t children = kStretchPlaces[level] / kStretchPlaces[level + 1];
  for (std::size_t i = 0; i < parents.size(); ++i) {
    if (i + kAhead < parents.size()) {
      prefetch(store_.bounds(level + 1, parents[i + kAhead].number * children).maxima,
               children * sizeof(BlockCounts));
    }
    if (!may_matter(level, parents[i])) continue;
    const std::size_t first = parents[i].number * children;
    bound_run(level + 1, first, first + children, kept);
  }
}

/// Searches stretches down to their places.
void PrunedSearch::descend(std::size_t level, std::span<Stretch> stretches) {
  if (level < kFinestLevel) {
    std::vector<Stretch>& children = children_[level + 1];
    children.clear();
    bound_children(level, stretches, children);
    descend(level + 1, children);
    return;
  }
  std::sort(stretches.begin(), stretches.end(), has_larger_bound<Stretch>);
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    if (i + kAhead < stretches.size()) {
      prefetch(&store_.content(stretches[i + kAhead].number * kFinestPlaces),
               kFinestPlaces * sizeof(BinaryContent));
    }
    if (may_matter(level, stretches[i])) compare_stretch(stretches[i].number);
  }
}

/// Searches stretches, those of large bounds first, so that the floor soon rises above the bounds
/// of the rest. Batches by bound, each in the order of places, take less time than sorting.
void PrunedSearch::search_best_first(std::size_t level, std::vector<Stretch> stretches) {
  constexpr std::size_t kBuckets = 1024;
  const auto bucket_of = [](const Stretch& stretch) {
    return std::min(static_cast<std::size_t>(stretch.bound * kBuckets), kBuckets - 1);
  };
  std::array<std::size_t, kBuckets> sizes{};
  for (const Stretch& stretch : stretches) ++sizes[bucket_of(stretch)];

  std::vector<Stretch> batch;
  std::vector<Stretch> rest;
  std::size_t wanted = kFirstBatch;
  for (std::size_t end = kBuckets; !stretches.empty(); wanted *= kBatchGrowth) {
    for (std::size_t got = 0; end > 0 && got < wanted;) got += sizes[--end];
    batch.clear();
    rest.clear();
    for (const Stretch& stretch : stretches) {
      if (may_matter(level, stretch)) (bucket_of(stretch) < end ? rest : batch).push_back(stretch);
    }
    stretches.swap(rest);
    const std::span<Stretch> all = batch;
    for (std::size_t first = 0; first < all.size(); first += kSlice) {
      descend(level, all.subspan(first, std::min(kSlice, all.size() - first)));
    }
  }
}

/// Searches the places behind the last whole stretch of the coarsest level.
void PrunedSearch::search_rest() {
  std::size_t searched = end_ - end_ % kStretchPlaces.front();
  for (std::size_t level = 1; level <= kFinestLevel; ++level) {
    const std::size_t first = searched / kStretchPlaces[level];
    const std::size_t last = end_ / kStretchPlaces[level];
    std::vector<Stretch> stretches;
    bound_run(level, first, last, stretches);
    descend(level, stretches);
    searched = last * kStretchPlaces[level];
  }
  if (searched < end_) compare_place(searched);
}

/// Compares the contents of a finest stretch with the query at the shifts that may matter.
void PrunedSearch::compare_stretch(std::size_t number) {
  const StretchBounds bounds = store_.bounds(kFinestLevel, number);
  const int larger = std::max<int>(query_count_, *bounds.smallest_counts);
  // The kernel takes the stretch for the query, which makes a sum of each shift.
  shift_sums_.resize(shift_counts_.size());
  kernels_.max_min_sums(bounds.maxima->of.data(), 1, shift_counts_.front().of.data(),
                        shift_counts_.size(), shift_sums_.data());
  const std::size_t first = number * kFinestPlaces;
  std::array<std::uint16_t, kFinestPlaces> best{};
  for (std::size_t shift = 0; shift < shifted_.size(); ++shift) {
    if (found_.is_below_floor(shift_sums_[shift], larger)) continue;
    std::array<std::uint16_t, kFinestPlaces> overlaps{};
    kernels_.max_overlaps(shifted_[shift].rows.data(), 1, store_.content(first).rows.data(),
                          kFinestPlaces, overlaps.data());
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
  const double xi = static_cast<double>(overlap) / std::max(query_count_, store_.count(place));
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
