// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "agreement.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace loopbit {
namespace {

/// A match moves at most this many places from one frame to the next, either way: revisits may be
/// slower or faster than the first visit, and candidates are only so finely spaced.
constexpr int kMaxPlacesPerFrame = 3;

int best_inliers_near(const std::vector<VerifiedCandidate>& frame, PlaceId place, int radius) {
  int best = 0;
  for (const VerifiedCandidate& other : frame) {
    if (std::abs(other.candidate.place - place) > radius) continue;
    best = std::max(best, other.distinct_inliers);
  }
  return best;
}

}  // namespace

double Agreement::score(const VerifiedCandidate& verified) const {
  if (verified.distinct_inliers == 0) return 0.0;
  int support = 0;
  int radius = kMaxPlacesPerFrame;
  for (auto frame = recent_.rbegin(); frame != recent_.rend(); ++frame) {
    const int inliers = best_inliers_near(*frame, verified.candidate.place, radius);
    support += std::max(0, inliers - options_.chance_inliers);
    radius += kMaxPlacesPerFrame;
  }
  return verified.distinct_inliers + options_.agreement_weight * support;
}

void Agreement::remember(std::vector<VerifiedCandidate> frame) {
  recent_.push_back(std::move(frame));
  while (recent_.size() > static_cast<std::size_t>(options_.agreement_frames)) recent_.pop_front();
}

}  // namespace loopbit
