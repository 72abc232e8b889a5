// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "place_filter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "evidence.hpp"

namespace loopbit {
namespace {

/// Poisson with mean 1, cut off: steps of the path in one step of the camera.
constexpr std::array kMoves{0.37, 0.37, 0.18, 0.06, 0.02};
/// A camera on a path turns round once in a hundred changes of view.
constexpr double kTurn = 0.01;
/// Somewhere new, it comes back to where it was once in fifty.
constexpr double kEnter = 0.02;
/// Steps with less are dropped, and those beyond so many: the work of a frame is bounded, however
/// large the map is.
constexpr double kMinMass = 1e-7;
constexpr std::ptrdiff_t kMaxSteps = 256;

/// In order of step, those of one step added up.
std::vector<Belief> merged(std::vector<Belief> parts) {
  std::stable_sort(parts.begin(), parts.end(),
                   [](const Belief& a, const Belief& b) { return a.step < b.step; });
  std::vector<Belief> steps;
  for (const Belief& part : parts) {
    if (steps.empty() || steps.back().step != part.step) steps.push_back({part.step, 0, 0});
    steps.back().forward += part.forward;
    steps.back().backward += part.backward;
  }
  return steps;
}

/// The least mass that a step must have to be kept.
double least_mass(const std::vector<Belief>& steps) {
  if (std::ssize(steps) <= kMaxSteps) return kMinMass;
  std::vector<double> masses;
  masses.reserve(steps.size());
  for (const Belief& belief : steps) masses.push_back(belief.mass());
  const auto last = masses.begin() + kMaxSteps;
  std::nth_element(masses.begin(), last, masses.end(), std::greater<>());
  return std::max(kMinMass, *last);
}

Beliefs with_rest_elsewhere(std::vector<Belief> steps) {
  Beliefs beliefs{std::move(steps), 1};
  for (const Belief& belief : beliefs.steps) beliefs.elsewhere -= belief.mass();
  beliefs.elsewhere = std::max(0.0, beliefs.elsewhere);
  return beliefs;
}

}  // namespace

double Beliefs::at(std::ptrdiff_t step) const {
  const auto found =
      std::lower_bound(steps.begin(), steps.end(), step,
                       [](const Belief& belief, std::ptrdiff_t s) { return belief.step < s; });
  return found == steps.end() || found->step != step ? 0.0 : found->mass();
}

Beliefs moved(const Beliefs& beliefs, double leave_probability,
              const std::function<bool(std::ptrdiff_t)>& exists) {
  std::vector<Belief> parts;
  parts.reserve(beliefs.steps.size() * kMoves.size() * 2);
  const auto add = [&](std::ptrdiff_t step, double forward, double backward) {
    if (exists(step)) parts.push_back({step, forward, backward});
  };
  for (const Belief& belief : beliefs.steps) {
    std::ptrdiff_t moves = 0;
    for (const double probability : kMoves) {
      const double stay = (1 - leave_probability) * probability;
      const double onward = stay * belief.forward;
      const double back = stay * belief.backward;
      add(belief.step + moves, onward * (1 - kTurn), onward * kTurn);
      add(belief.step - moves, back * kTurn, back * (1 - kTurn));
      ++moves;
    }
  }
  std::vector<Belief> steps = merged(std::move(parts));
  const double least = least_mass(steps);
  std::erase_if(steps, [&](const Belief& belief) { return belief.mass() <= least; });
  return with_rest_elsewhere(std::move(steps));
}

Beliefs only(const Beliefs& beliefs, const std::function<bool(std::ptrdiff_t)>& exists) {
  std::vector<Belief> steps;
  for (const Belief& belief : beliefs.steps) {
    if (exists(belief.step)) steps.push_back(belief);
  }
  return with_rest_elsewhere(std::move(steps));
}

Beliefs entered(const Beliefs& beliefs, const std::vector<StepEvidence>& evidence,
                std::ptrdiff_t num_steps) {
  const double each =
      kEnter * beliefs.elsewhere / static_cast<double>(std::max<std::ptrdiff_t>(1, num_steps));
  std::vector<Belief> parts = beliefs.steps;
  for (const StepEvidence& e : evidence) parts.push_back({e.step, each / 2, each / 2});
  return {merged(std::move(parts)),
          beliefs.elsewhere - each * static_cast<double>(evidence.size())};
}

Beliefs updated(const Beliefs& prior, const std::vector<StepEvidence>& evidence, double share) {
  double most = 0;
  for (const StepEvidence& e : evidence) most = std::max(most, e.log_ratio);
  const auto likelihood = [&](double log_ratio) { return std::exp(share * (log_ratio - most)); };
  Beliefs posterior{prior.steps, prior.elsewhere * likelihood(0)};
  double sum = posterior.elsewhere;
  auto seen = evidence.begin();
  for (Belief& belief : posterior.steps) {
    while (seen != evidence.end() && seen->step < belief.step) ++seen;
    const bool is_seen = seen != evidence.end() && seen->step == belief.step;
    const double factor = likelihood(is_seen ? seen->log_ratio : log_ratio_of_unseen());
    belief.forward *= factor;
    belief.backward *= factor;
    sum += belief.mass();
  }
  for (Belief& belief : posterior.steps) {
    belief.forward /= sum;
    belief.backward /= sum;
  }
  posterior.elsewhere /= sum;
  return posterior;
}

}  // namespace loopbit
