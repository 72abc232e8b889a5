// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "feature_matcher.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <numeric>

namespace loopbit {
namespace {

using Lanes = std::array<Descriptor, kMatchLanes>;

bool is_distinct(const NearestTwo& nearest, std::size_t lane, double max_ratio) {
  return nearest.distance_sq[lane] < max_ratio * max_ratio * nearest.second_distance_sq[lane];
}

/// The descriptors of dark and of bright blobs.
struct Groups {
  std::span<const Descriptor> dark;
  std::span<const Descriptor> bright;
};

/// The same part of each group, so that both together have `strongest` at most.
Groups strongest_of(const Features& features, std::size_t strongest) {
  const std::span<const Descriptor> all = features.descriptors;
  const std::size_t total = std::max<std::size_t>(1, all.size());
  const std::size_t kept = std::min(strongest, all.size());
  const std::size_t dark = features.num_dark * kept / total;
  return {all.first(dark), all.subspan(features.num_dark, kept - dark)};
}

}  // namespace

void FeatureMatcher::find_constants(Descriptors descriptors) {
  constants_.resize(descriptors.size());
  kernels_.describe_constants(descriptors.front().data(), descriptors.size(), constants_.data());
}

void FeatureMatcher::find_one_way(Descriptors query, std::span<const int> asked, Descriptors place,
                                  double max_ratio) {
  find_constants(place);
  NearestTwo nearest;
  Lanes lanes{};
  for (std::size_t begin = 0; begin < asked.size(); begin += kMatchLanes) {
    const std::size_t count = std::min(kMatchLanes, asked.size() - begin);
    for (std::size_t lane = 0; lane < count; ++lane) {
      lanes[lane] = query[static_cast<std::size_t>(asked[begin + lane])];
    }
    kernels_.nearest_two(lanes.front().data(), place.front().data(), constants_.data(),
                         place.size(), nearest);
    for (std::size_t lane = 0; lane < count; ++lane) {
      if (!is_distinct(nearest, lane, max_ratio)) continue;
      matches_.push_back({asked[begin + lane], nearest.index[lane]});
    }
  }
}

/// Asks back only for the places found, which are few.
void FeatureMatcher::keep_mutual(Descriptors query, Descriptors place, double max_ratio) {
  find_constants(query);
  NearestTwo nearest;
  Lanes lanes{};
  std::size_t kept = 0;
  for (std::size_t begin = 0; begin < matches_.size(); begin += kMatchLanes) {
    const std::size_t count = std::min(kMatchLanes, matches_.size() - begin);
    for (std::size_t lane = 0; lane < count; ++lane) {
      lanes[lane] = place[static_cast<std::size_t>(matches_[begin + lane].place)];
    }
    kernels_.nearest_two(lanes.front().data(), query.front().data(), constants_.data(),
                         query.size(), nearest);
    for (std::size_t lane = 0; lane < count; ++lane) {
      const Match match = matches_[begin + lane];
      if (nearest.index[lane] != match.query || !is_distinct(nearest, lane, max_ratio)) continue;
      matches_[kept++] = match;
    }
  }
  matches_.resize(kept);
}

void FeatureMatcher::match_group(Descriptors query, std::span<const int> asked, Descriptors place,
                                 double max_ratio) {
  matches_.clear();
  if (asked.empty() || place.empty()) return;
  find_one_way(query, asked, place, max_ratio);
  if (!matches_.empty()) keep_mutual(query, place, max_ratio);
}

void FeatureMatcher::match(const Features& query, const Features& place, double max_ratio,
                           std::size_t strongest, std::vector<Match>& matches) {
  static_assert(sizeof(Descriptor) == kDescriptorSize);
  const Groups of_query = strongest_of(query, strongest);
  const Groups of_place = strongest_of(place, strongest);
  asked_.resize(std::max(of_query.dark.size(), of_query.bright.size()));
  std::iota(asked_.begin(), asked_.end(), 0);
  const std::span<const int> all = asked_;
  match_group(of_query.dark, all.first(of_query.dark.size()), of_place.dark, max_ratio);
  matches = matches_;
  match_group(of_query.bright, all.first(of_query.bright.size()), of_place.bright, max_ratio);
  append_bright(query, place, matches);
}

void FeatureMatcher::match_some(const Features& query, std::span<const int> asked,
                                const Features& place, double max_ratio,
                                std::vector<Match>& matches) {
  const Groups of_query = strongest_of(query, query.descriptors.size());
  const Groups of_place = strongest_of(place, place.descriptors.size());
  const auto num_dark = static_cast<int>(query.num_dark);
  const auto bright = std::lower_bound(asked.begin(), asked.end(), num_dark);
  match_group(of_query.dark, {asked.begin(), bright}, of_place.dark, max_ratio);
  matches = matches_;
  asked_.clear();
  std::transform(bright, asked.end(), std::back_inserter(asked_),
                 [&](int index) { return index - num_dark; });
  match_group(of_query.bright, asked_, of_place.bright, max_ratio);
  append_bright(query, place, matches);
}

/// The matches of the bright group, which comes after the dark one in either image.
void FeatureMatcher::append_bright(const Features& query, const Features& place,
                                   std::vector<Match>& matches) const {
  for (const Match& match : matches_) {
    matches.push_back({match.query + static_cast<int>(query.num_dark),
                       match.place + static_cast<int>(place.num_dark)});
  }
}

}  // namespace loopbit
