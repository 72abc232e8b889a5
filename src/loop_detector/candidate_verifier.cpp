// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "candidate_verifier.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace loopbit {
namespace {

/// An inlier counts fully if so many of the features around the inliers are inliers themselves. If
/// only a door looks like another door, the walls around it do not match.
constexpr double kFullShare = 0.1;
/// The same for Evenness: about its median at right places of a street.
constexpr double kFullEvenness = 0.85;
/// An inlier counts less if a view shares more distinct inliers than this with the one before, but
/// at least half: a camera that hovers sees nearly all of it again.
constexpr double kFullViewInliers = 40;
constexpr double kMinWorthInRichView = 0.5;

/// Different places share a few inliers by chance; with so many they share a thing.
constexpr int kMinSightingInliers = 8;
/// Fewer matches of what a promising candidate has are chance, and hardly change its distinctness.
constexpr std::size_t kMinSharedMatches = 4;
/// A candidate with fewer matches in the first look has no more than chance in all: half of the
/// keypoints of either image make a quarter of the pairs, and 8 matches are chance.
constexpr std::size_t kMinFirstMatches = 3;
/// Of the places where the robot is expected, so many are looked at closer.
constexpr std::size_t kExpectedCloserLooks = 4;

}  // namespace

double inlier_worth(double explained_share, double evenness) {
  return std::min({1.0, std::sqrt(explained_share / kFullShare), evenness / kFullEvenness});
}

double view_worth(int distinct_inliers) {
  return std::clamp(kFullViewInliers / std::max(1, distinct_inliers), kMinWorthInRichView, 1.0);
}

struct CandidateVerifier::Frame {
  const Query& query;
  Evenness evenness;
  std::vector<VerifiedCandidate> verified;
  std::vector<Spot> promising;  ///< where promising candidates stand
  std::vector<int> features;    ///< of the query: inliers of one of them, in order

  void note_promising(const Spot& spot, const std::vector<Match>& inliers) {
    promising.push_back(spot);
    for (const Match& inlier : inliers) features.push_back(inlier.query);
    std::sort(features.begin(), features.end());
    features.erase(std::unique(features.begin(), features.end()), features.end());
  }

  /// Whether one of `matches` is of a feature that a promising candidate has.
  [[nodiscard]] bool may_share(const std::vector<Match>& matches) const {
    return std::any_of(matches.begin(), matches.end(), [&](const Match& match) {
      return std::binary_search(features.begin(), features.end(), match.query);
    });
  }
};

CandidateVerifier::CandidateVerifier(const LoopDetectorOptions& options, const Places& places,
                                     PlaceMemory::Held& held)
    : options_(options),
      places_(places),
      held_(held),
      verifier_(options.verification),
      votes_(options.verification.min_spacing_scales) {}

std::vector<VerifiedCandidate> CandidateVerifier::verify(const Query& query,
                                                         const std::vector<Candidate>& candidates,
                                                         std::size_t num_similar) {
  Frame frame{query, Evenness(query.view, query.features), {}, {}, {}};
  frame.verified.reserve(candidates.size());
  for (const Candidate& c : candidates) {
    frame.verified.push_back(
        {c, places_.step_of(c.place), !query.may_match || query.may_match(c.place)});
  }
  looks_.resize(std::max(looks_.size(), candidates.size()));
  look(frame);
  const auto closer = static_cast<std::size_t>(options_.verification.max_closer_looks);
  look_closer(frame, 0, num_similar, closer);
  look_closer(frame, num_similar, candidates.size(), kExpectedCloserLooks);
  if (!frame.promising.empty()) {
    look_at_others(frame);
    find_distinctness(frame);
  }
  return std::move(frame.verified);
}

void CandidateVerifier::complete(const Query& query, std::vector<VerifiedCandidate>& verified) {
  const Evenness evenness(query.view, query.features);
  for (VerifiedCandidate& v : verified) {
    if (v.geometry) continue;
    v.geometry = geometry_of(query, evenness, v.candidate.place, FirstLook{}, true);
  }
}

void CandidateVerifier::look(Frame& frame) {
  const Features& query = frame.query.features;
  const auto strongest = frame.query.closely
                             ? std::numeric_limits<std::size_t>::max()
                             : static_cast<std::size_t>(options_.verification.first_look_keypoints);
  const auto place = [&](std::size_t i) -> const Features& {
    return places_.features(frame.verified[i].candidate.place, held_);
  };
  const std::span looks = std::span(looks_).first(frame.verified.size());
  for (std::size_t i = 0; i < looks.size(); ++i) {
    verifier_.match_strongest(query, place(i), strongest, looks[i]);
  }
  votes_.begin(query, looks);
  for (std::size_t i = 0; i < looks.size(); ++i) {
    frame.verified[i].votes = votes_.count(query, place(i), looks[i]);
  }
}

/// Of the candidates from `first` to `last`, those with most matches in the first look: a place
/// that shares keypoints shares strong ones, too.
void CandidateVerifier::look_closer(Frame& frame, std::size_t first, std::size_t last,
                                    std::size_t most) {
  std::vector<std::size_t> order;
  order.reserve(last - first);
  for (std::size_t i = first; i < last; ++i) {
    if (frame.verified[i].may_match) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return looks_[a].matches.size() > looks_[b].matches.size();
  });
  order.resize(std::min(order.size(), most));
  for (const std::size_t i : order) {
    if (looks_[i].matches.size() < kMinFirstMatches) return;
    verify_in_full(frame, i, false);
  }
}

/// Verifies those that may have elsewhere what a promising candidate has.
void CandidateVerifier::look_at_others(Frame& frame) {
  for (std::size_t i = 0; i < frame.verified.size(); ++i) {
    const VerifiedCandidate& v = frame.verified[i];
    if (!v.may_match || v.geometry || !is_elsewhere(frame, v)) continue;
    if (!frame.may_share(looks_[i].matches)) continue;
    verifier_.match_some(frame.query.features, frame.features,
                         places_.features(v.candidate.place, held_), verification_);
    if (verification_.matches.size() >= kMinSharedMatches) verify_in_full(frame, i, true);
  }
}

void CandidateVerifier::verify_in_full(Frame& frame, std::size_t i, bool even_if_chance) {
  VerifiedCandidate& v = frame.verified[i];
  v.geometry =
      geometry_of(frame.query, frame.evenness, v.candidate.place, looks_[i], even_if_chance);
  if (v.geometry && v.geometry->excess() > 0) {
    frame.note_promising(spot_of(v), v.geometry->inliers);
  }
}

/// None where all matches together would be no more than chance, unless `even_if_chance`.
std::optional<CandidateGeometry> CandidateVerifier::geometry_of(const Query& query,
                                                                const Evenness& evenness,
                                                                PlaceId place,
                                                                const FirstLook& look,
                                                                bool even_if_chance) {
  Verification& result = verification_;
  const Features& features = places_.features(place, held_);
  verifier_.match(query.features, features, look, result);
  CandidateGeometry geometry{
      .matches = static_cast<int>(result.matches.size()),
      .chance_inliers = chance_inliers(query.features, features, query.camera)};
  if (options_.decision.count_matches) return geometry;
  geometry.view_worth = view_worth(query.view.distinct_inliers);
  const double most = geometry.matches * geometry.view_worth;
  if (most <= geometry.chance_inliers && !even_if_chance) return std::nullopt;
  verifier_.find_geometry(query.features, features, result, query.camera);
  geometry.inliers = result.inliers;
  geometry.distinct_inliers = result.distinct_inliers;
  geometry.inlier_worth = inlier_worth(
      result.explained_share, evenness.of(result.inliers, result.distinct_inliers, features));
  return geometry;
}

Spot CandidateVerifier::spot_of(const VerifiedCandidate& candidate) const {
  return places_.spot_of(candidate.candidate.place);
}

/// Whether it shows another place than each promising candidate, for all we know.
bool CandidateVerifier::is_elsewhere(const Frame& frame, const VerifiedCandidate& candidate) const {
  const Spot here = spot_of(candidate);
  return std::none_of(frame.promising.begin(), frame.promising.end(),
                      [&](const Spot& spot) { return is_same_place(here, spot); });
}

void CandidateVerifier::find_distinctness(Frame& frame) const {
  std::vector<Sighting> sightings;
  for (const VerifiedCandidate& v : frame.verified) {
    if (!v.geometry || v.geometry->distinct_inliers < kMinSightingInliers) continue;
    sightings.push_back({spot_of(v), v.geometry->inliers});
  }
  std::sort(sightings.begin(), sightings.end(), [](const Sighting& a, const Sighting& b) {
    return std::pair(a.spot.first_visit, a.spot.step) < std::pair(b.spot.first_visit, b.spot.step);
  });
  for (VerifiedCandidate& v : frame.verified) {
    if (!v.geometry || v.geometry->inliers.empty()) continue;
    v.geometry->distinctness = distinctness({spot_of(v), v.geometry->inliers}, sightings);
  }
}

}  // namespace loopbit
