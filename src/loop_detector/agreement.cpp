// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "agreement.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace loopbit {
namespace {

/// A match moves at most this many steps along the past for each step of the query, either way:
/// revisits may be slower or faster than the first visit, and candidates are only so finely spaced.
constexpr std::ptrdiff_t kMaxStepsPerStep = 3;

int best_evidence_near(const std::vector<VerifiedCandidate>& earlier, std::ptrdiff_t step,
                       std::ptrdiff_t radius) {
  int best = 0;
  for (const VerifiedCandidate& other : earlier) {
    if (std::abs(other.step - step) <= radius) best = std::max(best, other.distinct_inliers);
  }
  return best;
}

}  // namespace

double Agreement::score(const VerifiedCandidate& verified, bool is_step) const {
  if (verified.distinct_inliers == 0) return 0.0;
  const auto steps = static_cast<std::ptrdiff_t>(recent_.size());
  const std::ptrdiff_t latest = is_step ? steps - 1 : steps - 2;
  const std::ptrdiff_t oldest = std::max<std::ptrdiff_t>(0, latest + 1 - options_.agreement_steps);
  int support = 0;
  for (std::ptrdiff_t i = latest; i >= oldest; --i) {
    const std::ptrdiff_t radius = kMaxStepsPerStep * (latest + 1 - i);
    const int evidence =
        best_evidence_near(recent_[static_cast<std::size_t>(i)], verified.step, radius);
    support += std::max(0, evidence - options_.chance_inliers);
  }
  return verified.distinct_inliers + options_.agreement_weight * support;
}

void Agreement::remember(std::vector<VerifiedCandidate> step) {
  recent_.push_back(std::move(step));
  // One more than can support, for a query that shows what the last step showed.
  while (recent_.size() > static_cast<std::size_t>(options_.agreement_steps) + 1) {
    recent_.pop_front();
  }
}

}  // namespace loopbit
