// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "steady_displacements.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "votes_ratio.hpp"

namespace loopbit {
namespace {

/// The displacement changes by up to one bin either way, as a move by up to two steps.
constexpr double change(int bins) { return bins == 0 ? 0.5 : 0.25; }

using Others = std::vector<const Displacements*>;

/// Of the votes in a square, from those of other places there.
double sigmas_in(Displacements::Square square, const Displacements& here, const Others& others) {
  double sum = 0;
  double sum_sq = 0;
  for (const Displacements* other : others) {
    const double votes = stabilized(other->in_square(square));
    sum += votes;
    sum_sq += votes * votes;
  }
  const auto null = VotesNull::by_means(static_cast<double>(others.size()), sum, sum_sq);
  return clamped_sigmas(null.sigmas(here.in_square(square)));
}

SteadyDisplacements::Seen seen_around(Displacements::Square square, const Displacements& here,
                                      const Others& others) {
  const VotesRatio ratio(others.size());
  SteadyDisplacements::Seen seen{.sigmas = sigmas_in(square, here, others)};
  for (int down = -1; down <= 1; ++down) {
    for (int right = -1; right <= 1; ++right) {
      const auto moved = Displacements::moved(square, right, down);
      seen.ratio += change(down) * change(right) * ratio.of(sigmas_in(moved, here, others));
    }
  }
  return seen;
}

}  // namespace

std::optional<Displacements::Square> SteadyDisplacements::expected(std::ptrdiff_t step,
                                                                   bool is_step) const {
  const auto& steps = is_step ? latest_ : before_;
  const auto found = next_to(
      steps, step, [](const auto& each) { return each.first; },
      [&](const auto& a, const auto& b) {
        return std::abs(a.first - step) < std::abs(b.first - step);
      });
  if (found == steps.end()) return std::nullopt;
  return found->second;
}

std::vector<std::optional<SteadyDisplacements::Seen>> SteadyDisplacements::look(
    const std::vector<VerifiedCandidate>& verified, std::size_t num_similar, bool is_step,
    const IsNear& is_near) const {
  std::vector<std::optional<Seen>> all(verified.size());
  Others others;
  for (std::size_t i = 0; i < verified.size(); ++i) {
    const VerifiedCandidate& v = verified[i];
    const auto square = expected(v.step, is_step);
    if (!square) continue;
    others.clear();
    for (std::size_t j = 0; j < num_similar; ++j) {
      if (!is_near(verified[j].step, v.step)) others.push_back(&verified[j].votes.apart);
    }
    if (others.size() < kMinNull) continue;
    all[i] = seen_around(*square, v.votes.apart, others);
  }
  return all;
}

SteadyDisplacements::Next SteadyDisplacements::prepare(Squares fullest, const ByStep& wrong) const {
  return {.fullest = std::move(fullest), .wrong = wrong_.prepare(wrong)};
}

void SteadyDisplacements::commit(Next next) noexcept {
  before_ = std::exchange(latest_, std::move(next.fullest));
  wrong_.commit(std::move(next.wrong));
}

}  // namespace loopbit
