// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "full_scan.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

namespace loopbit::test {
namespace {

int overlap(const BinaryContent& a, const BinaryContent& b) {
  int pixels = 0;
  for (std::size_t y = 0; y < a.rows.size(); ++y) pixels += std::popcount(a.rows[y] & b.rows[y]);
  return pixels;
}

double shifted_similarity(const Contents& shifted, int query_count, const BinaryContent& place) {
  int best = 0;
  for (const BinaryContent& query : shifted) best = std::max(best, overlap(query, place));
  return best == 0 ? 0.0 : static_cast<double>(best) / std::max(query_count, count(place));
}

bool is_within_limit(const BinaryContent& query, const BinaryContent& place,
                     const RetrievalOptions& options) {
  const cv::Point2d apart = center(query) - center(place);
  return std::hypot(apart.x, apart.y) <= options.max_center_distance_px;
}

}  // namespace

std::vector<Candidate> full_scan(const Contents& places, const BinaryContent& query, PlaceId end,
                                 const RetrievalOptions& options, const PlaceTest& is_allowed) {
  const Contents shifted = tolerated_shifts(query, options.shift_tolerance_columns);
  std::vector<Candidate> left;
  for (PlaceId i = 0; i < end; ++i) {
    if (is_allowed && !is_allowed(i)) continue;
    const BinaryContent& place = places[static_cast<std::size_t>(i)];
    const double xi = shifted_similarity(shifted, count(query), place);
    if (xi > 0 && xi >= options.min_similarity && is_within_limit(query, place, options)) {
      left.push_back({i, xi});
    }
  }
  std::vector<Candidate> taken;
  while (!left.empty() && taken.size() < static_cast<std::size_t>(options.max_candidates)) {
    const Candidate best = *std::max_element(
        left.begin(), left.end(),
        [](const Candidate& a, const Candidate& b) { return a.similarity < b.similarity; });
    taken.push_back(best);
    std::erase_if(left, [&](const Candidate& other) {
      return std::abs(other.place - best.place) < options.min_spacing;
    });
  }
  return taken;
}

Contents random_contents(Random& random, int num_contents) {
  Contents contents;
  contents.reserve(static_cast<std::size_t>(num_contents));
  for (int i = 0; i < num_contents; ++i) {
    contents.push_back(random_content(random, 0.05 + 0.4 * random.uniform()));
  }
  return contents;
}

Contents coherent_contents(Random& random, int num_contents) {
  Contents contents{random_content(random, 0.2)};
  while (contents.size() < static_cast<std::size_t>(num_contents)) {
    BinaryContent next = shift_columns(contents.back(), random.between(-1, 1));
    for (int change = 0; change < 40; ++change) {
      next.rows[static_cast<std::size_t>(random.between(0, 63))] ^= std::uint64_t{1}
                                                                    << random.between(0, 63);
    }
    contents.push_back(next);
  }
  return contents;
}

}  // namespace loopbit::test
