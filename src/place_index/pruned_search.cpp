// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "pruned_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace loopbit {
namespace {

/// Neighbouring shifts that are bounded together in all but the finest stretches.
constexpr std::size_t kShiftsPerGroup = 3;
constexpr std::size_t kMaxShifts = 2 * 32 + 1;
constexpr std::uint32_t kAllGroups = ~std::uint32_t{0};
static_assert(kMaxShifts <= 32 * kShiftsPerGroup, "a group has a bit in 32");

/// Stretches whose bounds are computed by one call of a kernel.
constexpr std::size_t kRun = 16;

/// The level whose stretches are searched best first.
constexpr std::size_t kSortedLevel = 1;
/// So many of them go first, then kBatchGrowth times as many, and so on.
constexpr std::size_t kFirstBatch = 64;
constexpr std::size_t kBatchGrowth = 4;
/// So many are descended into together.
constexpr std::size_t kSlice = 64;

/// Memory is asked for so many stretches ahead of its use.
constexpr std::size_t kAhead = 6;

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
    const auto group = static_cast<std::uint32_t>(shifted_.size() / kShiftsPerGroup);
    shifted_.push_back(shift_columns(query, columns));
    single_.counts.push_back(block_counts(shifted_.back()));
    single_.groups.push_back(group);
    if (group == grouped_.counts.size()) {
      grouped_.counts.emplace_back();
      grouped_.groups.push_back(group);
    }
    raise(grouped_.counts.back(), single_.counts.back());
  }
}

std::vector<Candidate> PrunedSearch::run() {
  std::vector<Stretch> coarsest;
  const std::size_t stretches = end_ / kStretchPlaces.front();
  for (std::size_t first = 0; first < stretches; first += kRun) {
    bound_run(0, first, std::min(first + kRun, stretches), kAllGroups, coarsest);
  }
  // The most promising stretch gives a first floor, below which many others need no look inside.
  const auto best =
      std::max_element(coarsest.begin(), coarsest.end(),
                       [](const Stretch& a, const Stretch& b) { return a.bound < b.bound; });
  if (best != coarsest.end()) {
    const Stretch first = *best;
    coarsest.erase(best);
    descend(0, {&first, 1});
  }
  search_rest();
  std::vector<Stretch> finer;
  bound_children(0, coarsest, finer);
  search_best_first(kSortedLevel, finer);
  return std::move(found_).answer();
}

bool PrunedSearch::may_matter(std::size_t level, const Stretch& stretch) const {
  const std::size_t first = stretch.number * kStretchPlaces[level];
  return found_.may_matter(stretch.bound, static_cast<PlaceId>(first));
}

/// Bounds the stretches first to last - 1, at most kRun, of one chunk, and appends to `kept` those
/// that may matter.
void PrunedSearch::bound_run(std::size_t level, std::size_t first, std::size_t last,
                             std::uint32_t groups, std::vector<Stretch>& kept) {
  if (first >= last) return;
  const Variants& variants = level == kFinestLevel ? single_ : grouped_;
  std::array<const std::uint8_t*, kMaxShifts> queries{};
  std::array<std::uint32_t, kMaxShifts> groups_of{};
  std::size_t num_queries = 0;
  for (std::size_t v = 0; v < variants.counts.size(); ++v) {
    if (((groups >> variants.groups[v]) & 1U) == 0) continue;
    queries[num_queries] = variants.counts[v].of.data();
    groups_of[num_queries++] = variants.groups[v];
  }
  const std::size_t run = last - first;
  std::array<std::uint16_t, kMaxShifts * kRun> sums;  // NOLINT: written to before it is read
  kernels_.min_sums(queries.data(), num_queries, store_.maxima(level, first).of.data(), run,
                    sums.data());
  work_.stretches[level] += static_cast<std::int64_t>(run);

  for (std::size_t i = 0; i < run; ++i) {
    const int larger = std::max(query_count_, store_.smallest_count(level, first + i));
    const int least = found_.least_overlap(larger);
    std::uint32_t kept_groups = 0;
    int overlap = 0;
    for (std::size_t q = 0; q < num_queries; ++q) {
      const int sum = sums[q * run + i];
      kept_groups |= static_cast<std::uint32_t>(sum >= least) << groups_of[q];
      overlap = std::max(overlap, sum);
    }
    if (kept_groups == 0) continue;
    const double bound = static_cast<double>(std::min(overlap, query_count_)) / larger;
    const Stretch stretch{static_cast<std::uint32_t>(first + i), kept_groups, bound};
    if (may_matter(level, stretch)) kept.push_back(stretch);
  }
}

/// Appends to `kept` the stretches of the next level within `parents` that may matter.
void PrunedSearch::bound_children(std::size_t level, std::span<const Stretch> parents,
                                  std::vector<Stretch>& kept) {
  const std::size_t children = kStretchPlaces[level] / kStretchPlaces[level + 1];
  for (std::size_t i = 0; i < parents.size(); ++i) {
    if (i + kAhead < parents.size()) {
      prefetch(&store_.maxima(level + 1, parents[i + kAhead].number * children),
               children * sizeof(BlockCounts));
    }
    if (!may_matter(level, parents[i])) continue;
    const std::size_t first = parents[i].number * children;
    bound_run(level + 1, first, first + children, parents[i].groups, kept);
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
  constexpr std::size_t kPlaces = kStretchPlaces[kFinestLevel];
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    if (i + kAhead < stretches.size()) {
      prefetch(&store_.content(stretches[i + kAhead].number * kPlaces),
               kPlaces * sizeof(BinaryContent));
    }
    if (!may_matter(level, stretches[i])) continue;
    const std::size_t first = stretches[i].number * kPlaces;
    compare(first, first + kPlaces, stretches[i].groups);
  }
}

/// Searches stretches, those of large bounds first, so that the floor soon rises above the bounds
/// of the rest. Batches by bound, each in the order of places, take less time than sorting.
void PrunedSearch::search_best_first(std::size_t level, const std::vector<Stretch>& stretches) {
  constexpr std::size_t kBuckets = 1024;
  const auto bucket_of = [](const Stretch& stretch) {
    return std::min(static_cast<std::size_t>(stretch.bound * kBuckets), kBuckets - 1);
  };
  std::array<std::size_t, kBuckets> sizes{};
  for (const Stretch& stretch : stretches) ++sizes[bucket_of(stretch)];

  std::vector<Stretch> batch;
  std::size_t wanted = kFirstBatch;
  for (std::size_t end = kBuckets; end > 0; wanted *= kBatchGrowth) {
    std::size_t begin = end;
    for (std::size_t got = 0; begin > 0 && got < wanted;) got += sizes[--begin];
    batch.clear();
    for (const Stretch& stretch : stretches) {
      const std::size_t bucket = bucket_of(stretch);
      if (begin <= bucket && bucket < end && may_matter(level, stretch)) batch.push_back(stretch);
    }
    const std::span<const Stretch> all = batch;
    for (std::size_t first = 0; first < all.size(); first += kSlice) {
      descend(level, all.subspan(first, std::min(kSlice, all.size() - first)));
    }
    end = begin;
    if (static_cast<double>(end) < found_.floor().similarity * kBuckets) break;
  }
}

/// Searches the places behind the last whole stretch of the coarsest level.
void PrunedSearch::search_rest() {
  std::size_t searched = end_ - end_ % kStretchPlaces.front();
  for (std::size_t level = 1; level <= kFinestLevel; ++level) {
    const std::size_t first = searched / kStretchPlaces[level];
    const std::size_t last = end_ / kStretchPlaces[level];
    std::vector<Stretch> stretches;
    bound_run(level, first, last, kAllGroups, stretches);
    descend(level, stretches);
    searched = last * kStretchPlaces[level];
  }
  compare(searched, end_, kAllGroups);
}

/// Compares the contents of places, at most two, of one chunk, with the query at the shifts of
/// `groups`.
void PrunedSearch::compare(std::size_t first, std::size_t last, std::uint32_t groups) {
  if (first >= last) return;
  std::array<std::uint16_t, kStretchPlaces[kFinestLevel]> overlaps{};
  std::array<int, kStretchPlaces[kFinestLevel]> best{};
  for (std::size_t group = 0; group < grouped_.counts.size(); ++group) {
    if (((groups >> group) & 1U) == 0) continue;
    const std::size_t shift = group * kShiftsPerGroup;
    kernels_.max_overlaps(shifted_[shift].rows.data(),
                          std::min(kShiftsPerGroup, shifted_.size() - shift),
                          store_.content(first).rows.data(), last - first, overlaps.data());
    for (std::size_t i = 0; i < best.size(); ++i) best[i] = std::max<int>(best[i], overlaps[i]);
  }
  work_.contents += static_cast<std::int64_t>(last - first);
  for (std::size_t place = first; place < last; ++place) {
    const int overlap = best[place - first];
    if (overlap == 0) continue;
    const double xi = static_cast<double>(overlap) / std::max(query_count_, store_.count(place));
    const Candidate candidate{static_cast<PlaceId>(place), xi};
    if (found_.may_matter(xi, candidate.place) && is_within_limits(place)) found_.add(candidate);
  }
}

bool PrunedSearch::is_within_limits(std::size_t place) const {
  if (std::abs(query_count_ - store_.count(place)) > options_.max_count_difference) return false;
  // Within the map no two points are farther apart than this: there is no limit to look after.
  if (options_.max_center_distance_px >= kMaxCenterDistance_px) return true;
  const cv::Point2d apart = center(store_.content(place)) - query_center_;
  return std::hypot(apart.x, apart.y) <= options_.max_center_distance_px;
}

}  // namespace loopbit
