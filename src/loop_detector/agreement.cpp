// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "agreement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <utility>

namespace loopbit {
namespace {

/// A match moves at most this many steps along the past for each step of the query, either way:
/// revisits may be slower or faster than the first visit, and candidates are only so finely spaced.
constexpr std::ptrdiff_t kMaxStepsPerStep = 3;

/// An inlier counts at least so much, however much a view shares with the one before: a camera that
/// hovers sees nearly all of it again.
constexpr double kMinWorthInRichView = 0.5;

/// After so many steps little is left of a match's support.
constexpr std::ptrdiff_t kMaxStepsToWithdraw = 10;

/// With less support a way is not followed.
constexpr double kMinFollowedSupport = 1.0;

}  // namespace

double inlier_worth(double explained_share, const FrameContext& frame,
                    const DecisionOptions& options) {
  if (options.count_matches) return 1;
  double worth = 1;
  if (explained_share < options.full_share) worth = std::sqrt(explained_share / options.full_share);
  if (frame.earlier_steps < options.full_steps) {
    worth *= std::log1p(static_cast<double>(frame.earlier_steps)) / std::log1p(options.full_steps);
  }
  if (frame.view_inliers > options.full_view_inliers) {
    worth *= std::max(kMinWorthInRichView,
                      static_cast<double>(options.full_view_inliers) / frame.view_inliers);
  }
  return worth;
}

double Agreement::support_near(const std::vector<Trail>& trails, std::ptrdiff_t step) {
  double support = 0;
  for (const Trail& trail : trails) {
    if (std::abs(trail.step - step) <= kMaxStepsPerStep) support = std::max(support, trail.support);
  }
  return support;
}

double Agreement::score(const VerifiedCandidate& verified, bool is_step) const {
  const double evidence = verified.evidence();
  if (evidence == 0) return 0;
  const std::vector<Trail>& trails = is_step ? latest_ : before_latest_;
  return evidence + options_.agreement_weight * support_near(trails, verified.step);
}

void Agreement::remember(const std::vector<VerifiedCandidate>& step) {
  const auto beyond_chance = [&](const VerifiedCandidate& v) {
    return std::max(0.0, v.evidence() - options_.chance_evidence);
  };
  const bool is_known_place = std::any_of(
      step.begin(), step.end(), [&](const VerifiedCandidate& v) { return beyond_chance(v) > 0; });
  std::vector<Trail> trails;
  trails.reserve(step.size());
  for (const VerifiedCandidate& v : step) {
    if (is_known_place && beyond_chance(v) == 0) continue;
    const double before = options_.agreement_memory * support_near(latest_, v.step);
    trails.push_back({v.candidate.place, v.step, beyond_chance(v) + before});
  }
  before_latest_ = std::exchange(latest_, std::move(trails));
}

void Agreement::withdraw(std::ptrdiff_t step, std::ptrdiff_t steps_ago) {
  if (steps_ago > kMaxStepsToWithdraw) return;
  const std::ptrdiff_t reach = kMaxStepsPerStep * (steps_ago + 1);
  for (std::vector<Trail>* trails : {&latest_, &before_latest_}) {
    std::erase_if(*trails,
                  [&](const Trail& trail) { return std::abs(trail.step - step) <= reach; });
  }
}

std::vector<PlaceId> Agreement::followed_places() const {
  std::vector<Trail> trails = latest_;
  std::stable_sort(trails.begin(), trails.end(),
                   [](const Trail& a, const Trail& b) { return a.support > b.support; });
  std::vector<Trail> followed;
  for (const Trail& trail : trails) {
    if (trail.support < kMinFollowedSupport || std::ssize(followed) == options_.followed_ways)
      break;
    if (support_near(followed, trail.step) == 0) followed.push_back(trail);
  }
  std::vector<PlaceId> places;
  places.reserve(followed.size());
  for (const Trail& trail : followed) places.push_back(trail.place);
  return places;
}

}  // namespace loopbit
