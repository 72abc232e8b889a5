// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "displacement_votes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <tuple>

namespace loopbit {
namespace {

/// Of a feature nearest to each other on two levels of the pyramid, which are an octave apart.
constexpr float kMaxScaleRatio = 2.0F;
/// Displacements up to the whole image either way; a square of four bins is a tenth of its width.
constexpr int kBinsPerWidth = 20;
constexpr int kBins = 2 * kBinsPerWidth + 2;

struct Bin {
  int x = 0;
  int y = 0;
};

std::optional<Bin> bin_of(const Keypoint& a, const Keypoint& b, float bin_px) {
  if (a.scale > kMaxScaleRatio * b.scale || b.scale > kMaxScaleRatio * a.scale) return std::nullopt;
  const Bin bin{static_cast<int>(std::floor((a.x_px - b.x_px) / bin_px)) + kBins / 2,
                static_cast<int>(std::floor((a.y_px - b.y_px) / bin_px)) + kBins / 2};
  const auto is_in = [](int i) { return 0 <= i && i < kBins; };
  return is_in(bin.x) && is_in(bin.y) ? std::optional(bin) : std::nullopt;
}

/// How many displacements fall into each square of four bins, by its upper left bin.
using Squares = std::array<std::array<int, kBins>, kBins>;

/// Calls visit(x, y) for the squares that have `bin`.
template <typename Visit>
void for_each_square(const Bin& bin, const Visit& visit) {
  for (int y = std::max(0, bin.y - 1); y <= std::min(bin.y, kBins - 2); ++y) {
    for (int x = std::max(0, bin.x - 1); x <= std::min(bin.x, kBins - 2); ++x) visit(x, y);
  }
}

/// The square with most displacements; of equals the first one, row by row.
Bin fullest_square(const std::vector<std::optional<Bin>>& bins) {
  Squares counts{};
  const auto count = [&](int x, int y) -> int& {
    return counts[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
  };
  Bin best;
  int most = 0;
  for (const auto& bin : bins) {
    if (!bin) continue;
    for_each_square(*bin, [&](int x, int y) { most = std::max(most, ++count(x, y)); });
  }
  bool is_found = false;
  for (const auto& bin : bins) {
    if (!bin) continue;
    for_each_square(*bin, [&](int x, int y) {
      if (count(x, y) < most || (is_found && std::tie(best.y, best.x) <= std::tie(y, x))) return;
      best = {x, y};
      is_found = true;
    });
  }
  return best;
}

}  // namespace

std::vector<Match> nearest_matches(const Features& query, const Features& place,
                                   const FirstLook& look) {
  std::vector<Match> best(place.keypoints.size(), Match{-1, -1});
  std::vector<std::int32_t> distances_sq(place.keypoints.size());
  const auto offer = [&](const FirstLook::Group& group, std::size_t first_query,
                         std::size_t first_place) {
    for (std::size_t i = 0; i < group.nearest.size(); ++i) {
      const FirstLook::Neighbours& found = group.nearest[i];
      const std::size_t at = first_place + static_cast<std::size_t>(found.index);
      if (best[at].query >= 0 && found.distance_sq >= distances_sq[at]) continue;
      best[at] = {static_cast<int>(first_query + i), static_cast<int>(at)};
      distances_sq[at] = found.distance_sq;
    }
  };
  if (look.dark.num_query > 0) offer(look.dark, 0, 0);
  if (look.bright.num_query > 0) offer(look.bright, query.num_dark, place.num_dark);
  std::vector<Match> by_query(query.keypoints.size(), Match{-1, -1});
  for (const Match& match : best) {
    if (match.query >= 0) by_query[static_cast<std::size_t>(match.query)] = match;
  }
  std::erase_if(by_query, [](const Match& match) { return match.query < 0; });
  return by_query;
}

int displacement_votes(const Features& query, const Features& place,
                       const std::vector<Match>& matches, double min_spacing_scales) {
  const auto key = [](const Features& f, int i) -> const Keypoint& {
    return f.keypoints[static_cast<std::size_t>(i)];
  };
  const float bin_px = static_cast<float>(query.working_size_px.width) / kBinsPerWidth;
  std::vector<std::optional<Bin>> bins;
  bins.reserve(matches.size());
  for (const Match& match : matches) {
    bins.push_back(bin_of(key(query, match.query), key(place, match.place), bin_px));
  }
  const Bin square = fullest_square(bins);
  std::vector<Keypoint> counted;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Keypoint& here = key(query, matches[i].query);
    const auto& bin = bins[i];
    const auto is_in = [](int at, int first) { return first <= at && at <= first + 1; };
    if (!bin || !is_in(bin->x, square.x) || !is_in(bin->y, square.y)) continue;
    const bool is_new = std::none_of(counted.begin(), counted.end(), [&](const Keypoint& other) {
      const auto spacing = min_spacing_scales * std::min(here.scale, other.scale);
      return std::hypot(here.x_px - other.x_px, here.y_px - other.y_px) < spacing;
    });
    if (is_new) counted.push_back(here);
  }
  return static_cast<int>(counted.size());
}

}  // namespace loopbit
