// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "feature_matcher.hpp"

#include <algorithm>
#include <array>

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

void FeatureMatcher::find_one_way(Descriptors query, Descriptors place, double max_ratio) {
  find_constants(place);
  NearestTwo nearest;
  Lanes lanes{};
  for (std::size_t begin = 0; begin < query.size(); begin += kMatchLanes) {
    const std::size_t count = std::min(kMatchLanes, query.size() - begin);
    const Descriptor* descriptors = &query[begin];
    if (count < kMatchLanes) {
      std::copy_n(descriptors, count, lanes.begin());
      descriptors = lanes.data();
    }
    kernels_.nearest_two(descriptors->data(), place.front().data(), constants_.data(), place.size(),
                         nearest);
    for (std::size_t lane = 0; lane < count; ++lane) {
      if (!is_distinct(nearest, lane, max_ratio)) continue;
      matches_.push_back({static_cast<int>(begin + lane), nearest.index[lane]});
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

void FeatureMatcher::match_group(Descriptors query, Descriptors place, double max_ratio) {
  matches_.clear();
  if (query.empty() || place.empty()) return;
  find_one_way(query, place, max_ratio);
  keep_mutual(query, place, max_ratio);
}

void FeatureMatcher::match(const Features& query, const Features& place, double max_ratio,
                           std::size_t strongest, std::vector<Match>& matches) {
  static_assert(sizeof(Descriptor) == kDescriptorSize);
  const Groups of_query = strongest_of(query, strongest);
  const Groups of_place = strongest_of(place, strongest);
  match_group(of_query.dark, of_place.dark, max_ratio);
  matches = matches_;
  match_group(of_query.bright, of_place.bright, max_ratio);
  for (const Match& match : matches_) {
    matches.push_back({match.query + static_cast<int>(query.num_dark),
                       match.place + static_cast<int>(place.num_dark)});
  }
}

}  // namespace loopbit
