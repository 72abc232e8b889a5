// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "feature_matcher.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <iterator>
#include <numeric>

namespace loopbit {
namespace {

using Lanes = std::array<Descriptor, kMatchLanes>;
static_assert(sizeof(Lanes) == kMatchLanes * kDescriptorSize);

/// Appends the neighbours of the first `count` lanes.
void note(const NearestTwo& nearest, std::size_t count, std::vector<FirstLook::Neighbours>& noted) {
  for (std::size_t lane = 0; lane < count; ++lane) {
    noted.push_back(
        {nearest.index[lane], nearest.distance_sq[lane], nearest.second_distance_sq[lane]});
  }
}

/// What note() appended, from number `first` on.
NearestTwo noted_nearest(const std::vector<FirstLook::Neighbours>& noted, std::size_t first,
                         std::size_t count) {
  NearestTwo nearest{};
  for (std::size_t lane = 0; lane < count; ++lane) {
    const FirstLook::Neighbours& of_lane = noted[first + lane];
    nearest.index[lane] = of_lane.index;
    nearest.distance_sq[lane] = of_lane.distance_sq;
    nearest.second_distance_sq[lane] = of_lane.second_distance_sq;
  }
  return nearest;
}

bool is_distinct(const NearestTwo& nearest, std::size_t lane, double max_ratio) {
  return nearest.distance_sq[lane] < max_ratio * max_ratio * nearest.second_distance_sq[lane];
}

/// Takes into `nearest` those of `others`, counted from `first`, that are nearer; of equals, the
/// earlier ones stay.
void take_nearer(const NearestTwo& others, std::int32_t first, NearestTwo& nearest) {
  for (std::size_t lane = 0; lane < kMatchLanes; ++lane) {
    const std::int32_t known = nearest.distance_sq[lane];
    const std::int32_t found = others.distance_sq[lane];
    const bool is_nearer = found < known;
    nearest.second_distance_sq[lane] = is_nearer
                                           ? std::min(known, others.second_distance_sq[lane])
                                           : std::min(found, nearest.second_distance_sq[lane]);
    nearest.distance_sq[lane] = is_nearer ? found : known;
    nearest.index[lane] = is_nearer ? first + others.index[lane] : nearest.index[lane];
  }
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

/// Whether a first look compared all features that match() compares.
bool is_complete(const FirstLook& look, const Features& query, const Features& place) {
  const auto is_whole = [](const FirstLook::Group& group, std::size_t num_query,
                           std::size_t num_place) {
    return num_query == 0 || num_place == 0 ||
           (group.num_query == num_query && group.num_place == num_place);
  };
  return is_whole(look.dark, query.num_dark, place.num_dark) &&
         is_whole(look.bright, query.descriptors.size() - query.num_dark,
                  place.descriptors.size() - place.num_dark);
}

}  // namespace

void FeatureMatcher::find_constants(Descriptors descriptors) {
  constants_.resize(kMatchConstants * descriptors.size());
  kernels_.describe_constants(descriptors.front().data(), descriptors.size(), constants_.data());
}

/// 0, 1, 2, ... `count` - 1.
std::span<const int> FeatureMatcher::first_numbers(std::size_t count) {
  asked_.resize(count);
  std::iota(asked_.begin(), asked_.end(), 0);
  return asked_;
}

/// The nearest two of those `asked`, at most kMatchLanes, among `place`, whose constants were found
/// last.
void FeatureMatcher::find_nearest(Descriptors query, std::span<const int> asked, Descriptors place,
                                  NearestTwo& nearest) const {
  Lanes lanes{};
  for (std::size_t lane = 0; lane < asked.size(); ++lane) {
    lanes[lane] = query[static_cast<std::size_t>(asked[lane])];
  }
  kernels_.nearest_two(lanes.front().data(), place.front().data(), constants_.data(), place.size(),
                       nearest);
}

void FeatureMatcher::keep_distinct(std::span<const int> asked, const NearestTwo& nearest,
                                   double max_ratio) {
  for (std::size_t lane = 0; lane < asked.size(); ++lane) {
    if (!is_distinct(nearest, lane, max_ratio)) continue;
    matches_.push_back({asked[lane], nearest.index[lane]});
  }
}

void FeatureMatcher::find_one_way(Descriptors query, std::span<const int> asked, Descriptors place,
                                  double max_ratio, FirstLook::Group* noted) {
  find_constants(place);
  NearestTwo nearest;
  for (std::size_t begin = 0; begin < asked.size(); begin += kMatchLanes) {
    const auto lanes = asked.subspan(begin, std::min(kMatchLanes, asked.size() - begin));
    find_nearest(query, lanes, place, nearest);
    keep_distinct(lanes, nearest, max_ratio);
    if (noted != nullptr) note(nearest, lanes.size(), noted->nearest);
  }
}

/// Asks back only for the places found, which are few.
void FeatureMatcher::keep_mutual(Descriptors query, Descriptors place, double max_ratio) {
  find_constants(query);
  NearestTwo nearest;
  std::array<int, kMatchLanes> found{};
  std::size_t kept = 0;
  for (std::size_t begin = 0; begin < matches_.size(); begin += kMatchLanes) {
    const std::size_t count = std::min(kMatchLanes, matches_.size() - begin);
    for (std::size_t lane = 0; lane < count; ++lane) {
      found[lane] = matches_[begin + lane].place;
    }
    find_nearest(place, std::span(found).first(count), query, nearest);
    for (std::size_t lane = 0; lane < count; ++lane) {
      const Match match = matches_[begin + lane];
      if (nearest.index[lane] != match.query || !is_distinct(nearest, lane, max_ratio)) continue;
      matches_[kept++] = match;
    }
  }
  matches_.resize(kept);
}

void FeatureMatcher::match_group(Descriptors query, std::span<const int> asked, Descriptors place,
                                 double max_ratio, FirstLook::Group* noted) {
  matches_.clear();
  if (asked.empty() || place.empty()) return;
  find_one_way(query, asked, place, max_ratio, noted);
  if (!matches_.empty()) keep_mutual(query, place, max_ratio);
}

/// As match_group() for all of the query, where the neighbours of its first ones among the first of
/// the place are known.
void FeatureMatcher::match_rest(Descriptors query, Descriptors place, double max_ratio,
                                const FirstLook::Group& known) {
  matches_.clear();
  if (query.empty() || place.empty()) return;
  assert(known.num_query <= query.size() && known.num_place <= place.size());
  const std::span<const int> all = first_numbers(query.size());
  const std::span<const int> strongest = all.first(known.num_query);
  const Descriptors others = place.subspan(known.num_place);
  const bool has_others = !strongest.empty() && !others.empty();
  if (has_others) find_constants(others);
  for (std::size_t begin = 0; begin < strongest.size(); begin += kMatchLanes) {
    const auto lanes = strongest.subspan(begin, std::min(kMatchLanes, strongest.size() - begin));
    NearestTwo nearest = noted_nearest(known.nearest, begin, lanes.size());
    if (has_others) {
      NearestTwo among_others;
      find_nearest(query, lanes, others, among_others);
      take_nearer(among_others, static_cast<std::int32_t>(known.num_place), nearest);
    }
    keep_distinct(lanes, nearest, max_ratio);
  }
  find_one_way(query, all.subspan(known.num_query), place, max_ratio, nullptr);
  if (!matches_.empty()) keep_mutual(query, place, max_ratio);
}

void FeatureMatcher::match(const Features& query, const Features& place, double max_ratio,
                           const FirstLook& look, std::vector<Match>& matches) {
  if (is_complete(look, query, place)) {
    matches = look.matches;
    return;
  }
  const Groups of_query = strongest_of(query, query.descriptors.size());
  const Groups of_place = strongest_of(place, place.descriptors.size());
  match_rest(of_query.dark, of_place.dark, max_ratio, look.dark);
  matches = matches_;
  match_rest(of_query.bright, of_place.bright, max_ratio, look.bright);
  append_bright(query, place, matches);
}

void FeatureMatcher::match_strongest(const Features& query, const Features& place, double max_ratio,
                                     std::size_t strongest, FirstLook& look) {
  const Groups of_query = strongest_of(query, strongest);
  const Groups of_place = strongest_of(place, strongest);
  const auto match_noting = [&](Descriptors query_group, Descriptors place_group,
                                FirstLook::Group& noted) {
    noted.num_query = place_group.empty() ? 0 : query_group.size();
    noted.num_place = place_group.size();
    noted.nearest.clear();
    match_group(query_group, first_numbers(query_group.size()), place_group, max_ratio, &noted);
  };
  match_noting(of_query.dark, of_place.dark, look.dark);
  look.matches = matches_;
  match_noting(of_query.bright, of_place.bright, look.bright);
  append_bright(query, place, look.matches);
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
