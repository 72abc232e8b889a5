// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <vector>

#include "late_loops.hpp"
#include "place_filter.hpp"

namespace loopbit::test {

inline constexpr std::ptrdiff_t kSteps = 5000;
inline constexpr std::size_t kSimilar = 16;

/// What a frame finds at some steps.
struct Found {
  int votes = 0;
  int inliers = -1;                                            ///< -1: it was not looked at closer
  std::optional<Displacements::Square> square = std::nullopt;  ///< of the votes, if it is known
};
using FoundAt = std::map<std::ptrdiff_t, Found>;

inline VerifiedCandidate candidate(std::ptrdiff_t step, Found found) {
  VerifiedCandidate c{.candidate = {static_cast<PlaceId>(step), 0.5},
                      .step = step,
                      .votes = {.count = found.votes}};
  if (found.square) {
    c.votes.square = *found.square;
    const std::vector<int> bins(static_cast<std::size_t>(found.votes), *found.square);
    c.votes.apart = Displacements(bins);
  }
  if (found.inliers >= 0) {
    c.geometry =
        CandidateGeometry{.matches = 100,
                          .inliers = std::vector<Match>(static_cast<std::size_t>(found.inliers)),
                          .distinct_inliers = found.inliers};
  }
  return c;
}

/// A filter that knows the map from `warm_up` new places, and a robot whose frames look like
/// sixteen paths all over the map: each has a few votes by chance and no inliers.
struct FilterRobot {
  explicit FilterRobot(int warm_up = 40) {
    for (int i = 0; i < warm_up; ++i) see({});
  }

  PlaceFilter filter;
  LateLoops late_loops;
  double min_score = 0.98;
  KnownLoops loops;
  std::function<bool(std::ptrdiff_t)> may_be_at = [](std::ptrdiff_t) { return true; };
  std::function<double(std::ptrdiff_t)> return_weight = [](std::ptrdiff_t) { return 1.0; };
  AgreementOfMoves agreement = {};
  std::function<bool(std::ptrdiff_t)> may_match = [](std::ptrdiff_t) { return true; };
  std::size_t num_similar = kSimilar;
  std::vector<int> votes_just_left;
  int frame = 0;
  LateLoops::Found changed;  ///< by the latest frame

  [[nodiscard]] std::vector<VerifiedCandidate> candidates(const FoundAt& found) const {
    std::vector<VerifiedCandidate> all;
    std::mt19937 random(static_cast<std::uint32_t>(frame) + 1);
    for (std::size_t i = 0; i < num_similar; ++i) {
      const auto step = 1000 + 200 * static_cast<std::ptrdiff_t>(i) + frame;
      all.push_back(candidate(step, {2 + static_cast<int>(random() % 5)}));
    }
    for (const auto& [step, at] : found) all.push_back(candidate(step, at));
    for (VerifiedCandidate& c : all) c.may_match = may_match(c.step);
    return all;
  }

  [[nodiscard]] PlaceFilter::Update look(const FoundAt& found, bool is_step = true) const {
    return filter.update(filter.predict(is_step, agreement), candidates(found), num_similar,
                         {.number = kSteps,
                          .may_be_at = may_be_at,
                          .return_weight = return_weight,
                          .votes_just_left = votes_just_left},
                         loops);
  }

  PlaceFilter::Update see(const FoundAt& found, bool is_step = true) {
    const PlaceFilter::Update update = look(found, is_step);
    changed = late_loops.find(update, is_step, min_score, loops);
    const bool is_loop = update.match && update.probability >= min_score;
    late_loops.commit(LateLoops::prepare(update, frame, is_loop, loops), is_step, changed);
    filter.commit(filter.prepare(update, is_step, loops));
    ++frame;
    return update;
  }

  /// Frames at `first`, `first + speed`, ...
  PlaceFilter::Update follow(std::ptrdiff_t first, std::ptrdiff_t speed, int frames, Found found) {
    PlaceFilter::Update update;
    for (int i = 0; i < frames; ++i) update = see({{first + speed * i, found}});
    return update;
  }
};

inline constexpr Found kByNight{.votes = 22};
inline constexpr Found kByDay{.votes = 40, .inliers = 40};

}  // namespace loopbit::test
