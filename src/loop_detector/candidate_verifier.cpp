// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "candidate_verifier.hpp"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <tuple>
#include <utility>

#include "voted_paths.hpp"

namespace loopbit {
namespace {

/// Different places share a few inliers by chance; with so many they share a thing.
constexpr int kMinSightingInliers = 8;
/// Fewer matches of what a promising candidate has are chance, and hardly change its distinctness.
constexpr std::size_t kMinSharedMatches = 4;
/// The same in the first look, which meets a part of them.
constexpr std::size_t kMinSharedAtFirst = 1;
/// Of the places beside a candidate, so many are looked at closer.
constexpr std::size_t kMaxBeside = 4;
/// The nearest place shows at least this part of the distinct inliers that one beside it has.
constexpr double kMinPartOfInliers = 0.7;

}  // namespace

CandidateVerifier::CandidateVerifier(const LoopDetectorOptions& options, Places places,
                                     const Agreement& agreement, const KnownLoops& known_loops)
    : options_(options),
      places_(std::move(places)),
      agreement_(agreement),
      known_loops_(known_loops),
      verifier_(options.verification) {}

std::vector<VerifiedCandidate> CandidateVerifier::verify(const Query& query,
                                                         const std::vector<Candidate>& candidates) {
  promising_.clear();
  promising_features_.clear();
  sightings_.clear();
  num_looks_ = 0;
  std::vector<VerifiedCandidate> verified = unverified(candidates);
  verifications_.resize(std::max(verifications_.size(), verified.size()));
  const std::vector<std::size_t> order = by_first_look(query, verified);
  const auto closer =
      std::min(order.size(), static_cast<std::size_t>(options_.verification.max_closer_looks));
  look_closer(query, std::span(order).first(closer), verified);
  if (promising_.empty() || !options_.decision.distinctness) return verified;
  look_at_others(query, std::span(order).subspan(closer), verified);
  note_sightings(verified);
  for (std::size_t i = 0; i < verified.size(); ++i) {
    // Of those left out, what lies there is of an earlier frame.
    if (verified[i].inliers > 0) find_distinctness(verified[i], verifications_[i]);
  }
  return verified;
}

VerifiedCandidate CandidateVerifier::closest(const Query& query, const VerifiedCandidate& candidate,
                                             const std::vector<VerifiedCandidate>& verified,
                                             std::vector<Candidate> around) {
  const auto closeness = [](const VerifiedCandidate& v) {
    return std::tuple(v.distinct_inliers, v.inliers, v.candidate.similarity);
  };
  VerifiedCandidate best = candidate;
  std::erase_if(around, [&](const Candidate& c) { return c.place == candidate.candidate.place; });
  std::vector<VerifiedCandidate> neighbours = unverified(around);
  std::vector<std::size_t> order = by_first_look(query, neighbours);
  order.resize(std::min(order.size(), kMaxBeside));
  for (const std::size_t i : order) {
    VerifiedCandidate& neighbour = neighbours[i];
    Verification& result = match_once(query, verified, neighbour);
    if (neighbour.matches < best.distinct_inliers) continue;
    if (neighbour.inliers == 0) find_geometry(query, neighbour, result);
    if (closeness(neighbour) <= closeness(best)) continue;
    find_distinctness(neighbour, result);
    best = neighbour;
  }
  return best;
}

VerifiedCandidate CandidateVerifier::located(const Query& query, const VerifiedCandidate& candidate,
                                             const std::vector<VerifiedCandidate>& verified,
                                             const std::vector<Candidate>& around) {
  const std::vector<double> shared = shared_around(query, around);
  const auto shared_at = [&](PlaceId place) {
    const auto found = std::find_if(around.begin(), around.end(),
                                    [&](const Candidate& c) { return c.place == place; });
    return shared[static_cast<std::size_t>(found - around.begin())];
  };
  const PlaceId middle = candidate.candidate.place;
  std::vector<Candidate> nearer;
  for (const Candidate& c : around) {
    if (std::abs(c.place - middle) > options_.retrieval.min_spacing) continue;
    if (shared_at(c.place) > shared_at(middle)) nearer.push_back(c);
  }
  std::stable_sort(nearer.begin(), nearer.end(), [&](const Candidate& a, const Candidate& b) {
    return shared_at(a.place) > shared_at(b.place);
  });
  const double enough = kMinPartOfInliers * candidate.distinct_inliers;
  for (VerifiedCandidate& place : unverified(nearer)) {
    Verification& result = match_once(query, verified, place);
    if (place.matches < enough) continue;
    if (place.inliers == 0) find_geometry(query, place, result);
    if (place.distinct_inliers < enough) continue;
    VerifiedCandidate nearest = candidate;
    nearest.candidate = place.candidate;
    nearest.matches = place.matches;
    nearest.inliers = place.inliers;
    return nearest;
  }
  return candidate;
}

/// For each place, its matches averaged with those of the places beside it, at falling weight. One
/// place may have more matches than the next by chance, but what is in view is so from all of them.
/// One without keypoints, which could not be read, says nothing of the others.
std::vector<double> CandidateVerifier::shared_around(const Query& query,
                                                     const std::vector<Candidate>& around) {
  struct Place {
    PlaceId number;
    std::ptrdiff_t matches;
    bool speaks;
  };
  std::vector<Place> places;
  places.reserve(around.size());
  for (const Candidate& c : around) {
    places.push_back({c.place, std::ssize(first_look(query, c.place).matches),
                      !places_.features(c.place).keypoints.empty()});
  }
  std::vector<double> shared;
  shared.reserve(places.size());
  for (const Place& middle : places) {
    std::ptrdiff_t sum = 0;
    std::ptrdiff_t weights = 0;
    for (const Place& place : places) {
      const std::ptrdiff_t distance = std::abs(place.number - middle.number);
      if (!place.speaks || distance > kReach) continue;
      const std::ptrdiff_t weight = kReach + 1 - distance;
      sum += weight * place.matches;
      weights += weight;
    }
    shared.push_back(weights == 0 ? 0.0 : static_cast<double>(sum) / static_cast<double>(weights));
  }
  return shared;
}

int CandidateVerifier::votes(const Query& query, PlaceId place) {
  return displacement_votes(query.features, places_.features(place), first_look(query, place),
                            options_.verification.min_spacing_scales);
}

void CandidateVerifier::complete(const Query& query, std::vector<VerifiedCandidate>& verified) {
  for (VerifiedCandidate& v : verified) {
    if (v.inliers > 0) continue;
    match(query, v, verification_);
    find_geometry(query, v, verification_);
  }
}

std::vector<VerifiedCandidate> CandidateVerifier::unverified(
    const std::vector<Candidate>& candidates) const {
  std::vector<VerifiedCandidate> unverified;
  unverified.reserve(candidates.size());
  for (const Candidate& candidate : candidates) {
    unverified.push_back({candidate, places_.step_of(candidate.place)});
  }
  return unverified;
}

/// What the strongest keypoints tell, which is found once a frame; valid until the next look.
const FirstLook& CandidateVerifier::first_look(const Query& query, PlaceId place) {
  for (std::size_t i = 0; i < num_looks_; ++i) {
    if (looks_[i].place == place) return looks_[i].found;
  }
  if (num_looks_ == looks_.size()) looks_.emplace_back();
  Look& look = looks_[num_looks_++];
  look.place = place;
  verifier_.match_strongest(query.features, places_.features(place), look.found);
  return look.found;
}

/// Indices into `verified`, those first that may be expected to have the highest scores: a place
/// that shares keypoints shares strong ones, too.
std::vector<std::size_t> CandidateVerifier::by_first_look(
    const Query& query, const std::vector<VerifiedCandidate>& verified) {
  const auto keypoints = static_cast<double>(query.features.keypoints.size());
  const double looked_at = options_.verification.first_look_keypoints;
  const double worth =
      std::max(1.0, keypoints / looked_at) * inlier_worth(1.0, query.context, options_.decision);
  std::vector<std::pair<double, std::size_t>> scores;
  scores.reserve(verified.size());
  for (std::size_t i = 0; i < verified.size(); ++i) {
    VerifiedCandidate expected = verified[i];
    const auto matches = first_look(query, expected.candidate.place).matches.size();
    expected.distinct_inliers = static_cast<int>(matches);
    expected.inlier_worth = worth;
    scores.emplace_back(-agreement_.score(expected, query.is_step), i);
  }
  std::sort(scores.begin(), scores.end());
  std::vector<std::size_t> order;
  order.reserve(scores.size());
  for (const auto& [negative_score, i] : scores) order.push_back(i);
  return order;
}

/// The first half of the verification of a candidate: its matches.
void CandidateVerifier::match(const Query& query, VerifiedCandidate& candidate,
                              Verification& result) {
  const PlaceId place = candidate.candidate.place;
  const FirstLook& look = first_look(query, place);
  verifier_.match(query.features, places_.features(place), look, result);
  candidate.matches = static_cast<int>(result.matches.size());
}

/// The same, unless it is one of `verified` and was matched before; returns its matches.
Verification& CandidateVerifier::match_once(const Query& query,
                                            const std::vector<VerifiedCandidate>& verified,
                                            VerifiedCandidate& candidate) {
  for (std::size_t i = 0; i < verified.size(); ++i) {
    if (verified[i].matches == 0 || verified[i].candidate.place != candidate.candidate.place) {
      continue;
    }
    candidate = verified[i];
    return verifications_[i];
  }
  match(query, candidate, verification_);
  return verification_;
}

/// The second half: their geometry.
void CandidateVerifier::find_geometry(const Query& query, VerifiedCandidate& candidate,
                                      Verification& result) {
  const DecisionOptions& decision = options_.decision;
  if (decision.count_matches) {
    candidate.distinct_inliers = candidate.matches;
    return;
  }
  verifier_.find_geometry(query.features, places_.features(candidate.candidate.place), result);
  candidate.inliers = static_cast<int>(result.inliers.size());
  candidate.distinct_inliers = result.distinct_inliers;
  candidate.inlier_worth = inlier_worth(result.explained_share, query.context, decision);
}

/// The score if all matches were distinct inliers that explain all around them: no geometry can
/// lead to a higher one.
double CandidateVerifier::highest_score(const Query& query, VerifiedCandidate candidate) const {
  candidate.distinct_inliers = candidate.matches;
  candidate.inlier_worth = inlier_worth(1.0, query.context, options_.decision);
  return agreement_.score(candidate, query.is_step);
}

/// Matches in full, and seeks the geometry of those with the most matches first, until none of the
/// others can have a higher score than the best. One with more evidence than chance gives is
/// promising; then others that may have what it has elsewhere are verified all the same, to see how
/// much of it they share.
void CandidateVerifier::look_closer(const Query& query, std::span<const std::size_t> order,
                                    std::vector<VerifiedCandidate>& verified) {
  std::vector<std::pair<double, std::size_t>> bounds;
  bounds.reserve(order.size());
  for (const std::size_t i : order) {
    match(query, verified[i], verifications_[i]);
    bounds.emplace_back(-highest_score(query, verified[i]), i);
  }
  std::sort(bounds.begin(), bounds.end());
  double best = 0;
  for (const auto& [negative_bound, i] : bounds) {
    const bool may_win = -negative_bound >= best;
    const auto may_share = [&, place = i] {
      return is_elsewhere(verified[place]) &&
             num_shared(verifications_[place].matches) >= kMinSharedMatches;
    };
    if (!may_win && !may_share()) continue;
    find_geometry(query, verified[i], verifications_[i]);
    best = std::max(best, agreement_.score(verified[i], query.is_step));
    note_promising(verified[i], verifications_[i]);
  }
}

/// Verifies those that may have elsewhere what a promising candidate has.
void CandidateVerifier::look_at_others(const Query& query, std::span<const std::size_t> order,
                                       std::vector<VerifiedCandidate>& verified) {
  for (const std::size_t i : order) {
    if (!is_elsewhere(verified[i])) continue;
    const PlaceId number = verified[i].candidate.place;
    if (num_shared(first_look(query, number).matches) < kMinSharedAtFirst) continue;
    const Features& place = places_.features(number);
    verifier_.match_some(query.features, promising_features_, place, verification_);
    if (verification_.matches.size() < kMinSharedMatches) continue;
    match(query, verified[i], verifications_[i]);
    find_geometry(query, verified[i], verifications_[i]);
    note_promising(verified[i], verifications_[i]);
  }
}

void CandidateVerifier::note_promising(const VerifiedCandidate& candidate,
                                       const Verification& result) {
  if (candidate.evidence() <= options_.decision.chance_evidence) return;
  promising_.push_back(spot_of(candidate));
  std::vector<int>& features = promising_features_;
  for (const Match& inlier : result.inliers) features.push_back(inlier.query);
  std::sort(features.begin(), features.end());
  features.erase(std::unique(features.begin(), features.end()), features.end());
}

Spot CandidateVerifier::spot_of(const VerifiedCandidate& candidate) const {
  return {candidate.step, known_loops_.first_visit(candidate.step)};
}

/// Whether it shows another place than each promising candidate, for all we know.
bool CandidateVerifier::is_elsewhere(const VerifiedCandidate& candidate) const {
  const Spot here = spot_of(candidate);
  return std::none_of(promising_.begin(), promising_.end(),
                      [&](const Spot& spot) { return is_same_place(here, spot); });
}

/// Of `matches`, those whose feature of the query is an inlier of a promising candidate.
std::size_t CandidateVerifier::num_shared(const std::vector<Match>& matches) const {
  const auto shared = std::count_if(matches.begin(), matches.end(), [&](const Match& match) {
    return std::binary_search(promising_features_.begin(), promising_features_.end(), match.query);
  });
  return static_cast<std::size_t>(shared);
}

/// The candidates with enough inliers to show that their place has what the query has.
void CandidateVerifier::note_sightings(const std::vector<VerifiedCandidate>& verified) {
  for (std::size_t i = 0; i < verified.size(); ++i) {
    if (verified[i].distinct_inliers < kMinSightingInliers) continue;
    sightings_.push_back({spot_of(verified[i]), verifications_[i].inliers});
  }
  std::sort(sightings_.begin(), sightings_.end(), [](const Sighting& a, const Sighting& b) {
    return std::pair(a.spot.first_visit, a.spot.step) < std::pair(b.spot.first_visit, b.spot.step);
  });
}

void CandidateVerifier::find_distinctness(VerifiedCandidate& candidate,
                                          const Verification& result) const {
  candidate.distinctness = distinctness({spot_of(candidate), result.inliers}, sightings_);
}

}  // namespace loopbit
