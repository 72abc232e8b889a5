// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "candidate_finder.hpp"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "distinctness.hpp"
#include "place_filter.hpp"

namespace loopbit {
namespace {

/// Paths worth looking at, even where they do not look alike.
constexpr std::size_t kFollowedPaths = 3;
constexpr double kMinFollowedProbability = 2e-3;
/// On each, the places up to so many steps away.
constexpr std::ptrdiff_t kFollowedReach = 2;
/// Places that the robot has just left show what is common to its surroundings: so many of them are
/// looked at.
constexpr std::ptrdiff_t kPlacesJustLeft = 2;
/// With odometry, so many times as many places are looked up, up to kMaxCandidates: those of other
/// storeys may look more alike than the one where the robot is.
constexpr int kLookAlikes = 10;
/// Where too many similar places are laps, the search for others begins with so many times as many
/// places, and doubles from there.
constexpr int kFirstLookUp = 4;

/// How many of `num_places` similar places must show different places to serve as the null of the
/// votes: if a third of them are laps through the right place, their median moves by two thirds of
/// a deviation.
std::size_t min_different(std::size_t num_places) { return 2 * num_places / 3 + 1; }

bool is_among(const std::vector<Candidate>& candidates, PlaceId place) {
  return std::ranges::find(candidates, place, &Candidate::place) != candidates.end();
}

}  // namespace

FrameCandidates CandidateFinder::find(const Query& query, PlaceTest is_allowed) const {
  FrameCandidates found{.end = query.view.begin, .is_allowed = std::move(is_allowed)};
  add_similar(query, found);
  if (options_.decision.count_matches) return found;
  add_expected(query, found);
  add_just_left(query, found);
  return found;
}

Candidate CandidateFinder::candidate(PlaceId place, const BinaryContent& content) const {
  return {place, similarity(content, places_.contents().content(place),
                            options_.retrieval.shift_tolerance_columns)};
}

/// Whether the robot is sure to be at an earlier place.
bool CandidateFinder::is_back(const Query& query) const {
  return 1 - query.prior.elsewhere() >= options_.decision.min_score;
}

bool CandidateFinder::are_one_place(const std::vector<std::ptrdiff_t>& steps) const {
  const KnownLoops& loops = places_.known_loops();
  const Spot first = spot_of(steps.front(), loops);
  return std::ranges::all_of(
      steps, [&](std::ptrdiff_t step) { return is_same_place(first, spot_of(step, loops)); });
}

/// By odometry, only those in reach may match. The others still show what wrong places have, and in
/// their stead less similar ones may match, too.
void CandidateFinder::add_similar(const Query& query, FrameCandidates& found) const {
  const auto most = static_cast<std::size_t>(options_.retrieval.max_candidates);
  const PlaceTest is_wanted = found.is_allowed;
  const auto look_up = [&](int times) {
    RetrievalOptions retrieval = options_.retrieval;
    retrieval.max_candidates = std::min(kMaxCandidates, times * retrieval.max_candidates);
    return places_.contents().query(query.content, found.end, retrieval, is_wanted);
  };
  std::vector<Candidate> similar = look_up(query.odometry ? kLookAlikes : 1);
  std::vector<Candidate> also_in_reach;
  if (query.odometry) {
    keep_in_reach(*query.odometry, found);
    for (std::size_t i = 0; i < similar.size(); ++i) {
      const bool in_reach = found.is_allowed(similar[i].place);
      if (i < most && !in_reach) found.too_far.push_back(similar[i]);
      if (i >= most && in_reach && also_in_reach.size() < found.too_far.size()) {
        also_in_reach.push_back(similar[i]);
      }
    }
    similar.resize(std::min(most, similar.size()));
  }
  // Half of them are rivals enough.
  if (is_back(query)) similar.resize((similar.size() + 1) / 2);
  found.num_similar = put_different_first(look_up, similar);
  found.places = std::move(similar);
  for (const Candidate& other : also_in_reach) {
    if (!is_among(found.places, other.place)) found.places.push_back(other);
  }
}

/// The null of the votes must come from wrong places, not from laps through the right one. If too
/// many of the similar places are laps, this puts the most similar different ones first; the most
/// similar laps remain candidates behind them. Returns how many places form the null.
std::size_t CandidateFinder::put_different_first(const LookUp& look_up,
                                                 std::vector<Candidate>& similar) const {
  const std::size_t least = min_different(similar.size());
  std::vector<Candidate> rivals = different(similar, least);
  if (rivals.size() == least || similar.empty()) return similar.size();
  for (int times = kFirstLookUp; rivals.size() < least; times *= 2) {
    const std::vector<Candidate> more = look_up(times);
    // In a small map, all places would be needed, and most do not look like this one.
    const int asked = times * options_.retrieval.max_candidates;
    if (std::ssize(more) < asked) return similar.size();
    rivals = different(more, least);
  }
  for (const Candidate& lap : similar) {
    if (rivals.size() < similar.size() && !is_among(rivals, lap.place)) rivals.push_back(lap);
  }
  similar = std::move(rivals);
  return least;
}

/// The first of `similar` that are not laps through one place, at most `most` of them. Two places
/// are laps if their first visits are less than `min_spacing` steps apart but they are not.
std::vector<Candidate> CandidateFinder::different(const std::vector<Candidate>& similar,
                                                  std::size_t most) const {
  const std::ptrdiff_t spacing = options_.retrieval.min_spacing;
  std::vector<Candidate> found;
  std::vector<Spot> spots;
  for (const Candidate& candidate : similar) {
    if (found.size() == most) break;
    const Spot spot = spot_of(places_.step_of(candidate.place), places_.known_loops());
    const auto is_lap = [&](const Spot& other) {
      return std::abs(spot.first_visit - other.first_visit) < spacing &&
             std::abs(spot.step - other.step) >= spacing;
    };
    if (std::ranges::any_of(spots, is_lap)) continue;
    found.push_back(candidate);
    spots.push_back(spot);
  }
  return found;
}

void CandidateFinder::keep_in_reach(const OdometryPose& odometry, FrameCandidates& found) const {
  found.reach = std::make_unique<Reach>(odometry_.reach(odometry));
  found.is_allowed = [this, end = found.end, &reach = *found.reach,
                      is_wanted = std::exchange(found.is_allowed, {})](PlaceId place) {
    return (!is_wanted || is_wanted(place)) && odometry_.chi2(reach, place, end) <= Reach::kMaxChi2;
  };
}

/// A robot that revisits keeps revisiting, even where a place does not look like itself for a
/// while. Where it surely does and all paths are laps through one place, one of them is enough to
/// look around, so that a frame costs less after many laps.
void CandidateFinder::add_expected(const Query& query, FrameCandidates& found) const {
  const std::vector<std::ptrdiff_t> paths =
      PlaceFilter::likeliest(query.prior, kMinFollowedProbability, kFollowedPaths);
  const bool are_laps = paths.size() == kFollowedPaths && is_back(query) && are_one_place(paths);
  for (const std::ptrdiff_t middle : paths) {
    const std::ptrdiff_t reach = are_laps && middle != paths.front() ? 0 : kFollowedReach;
    for (std::ptrdiff_t step = middle - reach; step <= middle + reach; ++step) {
      const auto place = places_.place_of(step);
      if (!place || !found.may_match(*place) || is_among(found.places, *place)) continue;
      const Candidate expected = candidate(*place, query.content);
      // Nothing is like a frame that could not be read.
      if (expected.similarity > 0) found.places.push_back(expected);
    }
  }
}

/// The oldest places of the exclusion window that are out of view.
void CandidateFinder::add_just_left(const Query& query, FrameCandidates& found) const {
  if (places_.recent_view().empty()) return;
  const std::size_t before = found.places.size();
  const auto in_view = static_cast<std::ptrdiff_t>(query.view.look.far_step);
  const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, places_.step_of(found.end));
  for (std::ptrdiff_t step = first; step < std::min(first + kPlacesJustLeft, in_view); ++step) {
    const auto place = places_.place_of(step);
    if (place && *place >= found.end) found.places.push_back(candidate(*place, query.content));
  }
  found.num_just_left = found.places.size() - before;
}

}  // namespace loopbit
