// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/place_index.hpp"

#include <algorithm>
#include <cstdlib>

#include "loopbit/kernels.hpp"

namespace loopbit {
namespace {

static_assert(sizeof(BinaryContent) == kContentWords * sizeof(std::uint64_t),
              "the kernels walk an array of contents as an array of words");

std::vector<BinaryContent> shifted_queries(const BinaryContent& content, int tolerance) {
  std::vector<BinaryContent> queries;
  for (int columns = -tolerance; columns <= tolerance; ++columns) {
    queries.push_back(shift_columns(content, columns));
  }
  return queries;
}

/// Leaves the best `enough` candidates, in order.
void keep_best(std::vector<Candidate>& candidates, std::size_t enough) {
  enough = std::min(enough, candidates.size());
  const auto end = candidates.begin() + static_cast<std::ptrdiff_t>(enough);
  std::partial_sort(
      candidates.begin(), end, candidates.end(), [](const Candidate& a, const Candidate& b) {
        return a.similarity != b.similarity ? a.similarity > b.similarity : a.place < b.place;
      });
  candidates.resize(enough);
}

std::vector<Candidate> space_out(const std::vector<Candidate>& ranked, std::size_t most,
                                 int min_spacing) {
  std::vector<Candidate> taken;
  for (const Candidate& candidate : ranked) {
    if (taken.size() == most) break;
    const bool too_close = std::any_of(taken.begin(), taken.end(), [&](const Candidate& other) {
      return std::abs(candidate.place - other.place) < min_spacing;
    });
    if (!too_close) taken.push_back(candidate);
  }
  return taken;
}

}  // namespace

PlaceId PlaceIndex::add(const BinaryContent& content) {
  contents_.push_back(content);
  counts_.push_back(count(content));
  return size() - 1;
}

const BinaryContent& PlaceIndex::content(PlaceId place) const {
  return contents_.at(static_cast<std::size_t>(place));
}

std::vector<Candidate> PlaceIndex::query(const BinaryContent& content, PlaceId end,
                                         const RetrievalOptions& options) const {
  validate(options, "retrieval");
  end = std::min(end, size());
  const int query_count = count(content);
  if (end <= 0 || query_count == 0) return {};

  const auto queries = shifted_queries(content, options.shift_tolerance_columns);
  std::vector<std::uint16_t> overlaps(static_cast<std::size_t>(end));
  active_kernels().max_overlaps(queries.front().rows.data(), queries.size(),
                                contents_.front().rows.data(), overlaps.size(), overlaps.data());

  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < overlaps.size(); ++i) {
    const double xi = static_cast<double>(overlaps[i]) / std::max(query_count, counts_[i]);
    if (xi > 0 && xi >= options.min_similarity) {
      candidates.push_back({static_cast<PlaceId>(i), xi});
    }
  }
  // A candidate taken rules out at most 2 * (min_spacing - 1) others, so these are enough to rank.
  const auto most = static_cast<std::size_t>(options.max_candidates);
  keep_best(candidates, most * static_cast<std::size_t>(2 * options.min_spacing - 1));
  return space_out(candidates, most, options.min_spacing);
}

}  // namespace loopbit
