// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "path_motion.hpp"

#include <algorithm>
#include <array>
#include <map>

namespace loopbit {
namespace {

/// A robot is somewhere new for a hundred changes of view on average, and then follows an earlier
/// path for about as long. Where frames say little, such as by night, this limits the score.
constexpr double kUsualSteps = 100;
constexpr double kReturn = 1 / kUsualSteps;
/// A hundred changes of view are 33 independent ones, as long as nothing is known. With more images
/// of the same path, each has less to say, and the path ends at it more seldom.
constexpr double kUsualIndependent = kUsualSteps / 3;
/// A path is followed at 0, 1 or 2 steps per step, most likely at the speed of before.
constexpr std::array<double, kMaxMove + 1> kMoves{0.25, 0.5, 0.25};
/// Robots seldom turn round on a path.
constexpr double kTurn = 0.01;

/// The item of `step`, or the end. `items`: in the order of steps.
template <typename Items>
auto item_at(const Items& items, std::ptrdiff_t step) {
  using Item = typename Items::value_type;
  const auto found = std::ranges::lower_bound(items, step, {}, &Item::step);
  return found != items.end() && found->step == step ? found : items.end();
}

/// Of each state one step later, its probability after all frames by its predicted one.
class Ratios {
 public:
  Ratios(const Belief& prior, const Returns& returns, const Belief& later) {
    const double elsewhere = prior.elsewhere();
    double away = 1;
    const double new_ratio = elsewhere > 0 ? later.elsewhere() / elsewhere : 0.0;
    for (const Hypothesis& h : prior.places) ratios_.push_back({h.step, 0, 0});
    for (const Hypothesis& h : later.places) {
      const auto known = item_at(prior.places, h.step);
      if (known == prior.places.end()) continue;
      Hypothesis& ratio = ratios_[static_cast<std::size_t>(known - prior.places.begin())];
      if (known->forward > 0) ratio.forward = h.forward / known->forward;
      if (known->backward > 0) ratio.backward = h.backward / known->backward;
    }
    for (const auto& [step, probability] : returns) {
      const auto there = item_at(ratios_, step);
      if (there == ratios_.end()) continue;
      away -= 2 * probability;
      away_ += probability * (there->forward + there->backward);
    }
    away_ += away * new_ratio;
  }

  /// Of a robot that is elsewhere, before it returns or not.
  [[nodiscard]] double away() const { return away_; }

  /// Of the steps that `step` can be reached from or leads to, in order. What could not be
  /// predicted, such as an excluded step, was left for elsewhere.
  [[nodiscard]] std::array<Hypothesis, 2 * kMaxMove + 1> around(std::ptrdiff_t step) const {
    std::array<Hypothesis, 2 * kMaxMove + 1> near{};
    auto found = std::ranges::lower_bound(ratios_, step - kMaxMove, {}, &Hypothesis::step);
    for (Hypothesis& h : near) {
      h = {step - kMaxMove + (&h - near.data()), away_, away_};
      if (found != ratios_.end() && found->step == h.step) h = *found++;
    }
    return near;
  }

 private:
  std::vector<Hypothesis> ratios_;
  double away_ = 0;
};

}  // namespace

double Belief::elsewhere() const {
  double sum = 0;
  for (const Hypothesis& h : places) sum += h.probability();
  return std::max(0.0, 1 - sum);
}

double Belief::at(std::ptrdiff_t step) const {
  const auto found = item_at(places, step);
  return found == places.end() ? 0.0 : found->probability();
}

std::optional<std::ptrdiff_t> Belief::peak() const {
  if (places.empty()) return std::nullopt;
  return std::ranges::max_element(places, {}, &Hypothesis::probability)->step;
}

Hypothesis& hypothesis_at(std::vector<Hypothesis>& places, std::ptrdiff_t step) {
  auto found = std::ranges::lower_bound(places, step, {}, &Hypothesis::step);
  if (found == places.end() || found->step != step) found = places.insert(found, {step});
  return *found;
}

double from_anywhere(std::ptrdiff_t num_steps) {
  return kReturn / static_cast<double>(std::max<std::ptrdiff_t>(1, num_steps));
}

double probability_at(const Returns& returns, std::ptrdiff_t step) {
  const auto found = item_at(returns, step);
  return found == returns.end() ? 0.0 : found->probability;
}

Returns returns_to(std::vector<std::ptrdiff_t> steps, std::ptrdiff_t num_steps,
                   const std::function<double(std::ptrdiff_t)>& weight) {
  std::ranges::sort(steps);
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
  Returns returns;
  returns.reserve(steps.size());
  for (const std::ptrdiff_t step : steps) {
    returns.push_back({step, from_anywhere(num_steps) / 2 * weight(step)});
  }
  return returns;
}

/// The mean of a rate that is not known, as if one path had ended after the usual number of steps.
/// The longer the robot has followed its path, the longer that is expected to go on.
double leave_probability(double independence, const Followed& followed) {
  return std::min(1 / (kUsualSteps + followed.steps),
                  independence / (kUsualIndependent + followed.independent));
}

Belief one_step_later(const Belief& belief, double leave) {
  std::map<std::ptrdiff_t, Hypothesis> next;
  for (const Hypothesis& h : belief.places) {
    const double forward = (1 - leave) * ((1 - kTurn) * h.forward + kTurn * h.backward);
    const double backward = (1 - leave) * ((1 - kTurn) * h.backward + kTurn * h.forward);
    for (std::size_t moved = 0; moved < kMoves.size(); ++moved) {
      const auto steps = static_cast<std::ptrdiff_t>(moved);
      next[h.step + steps].forward += kMoves[moved] * forward;
      next[h.step - steps].backward += kMoves[moved] * backward;
    }
  }
  Belief later{.places = {}, .leave = leave};
  later.places.reserve(next.size());
  for (const auto& [step, h] : next) later.places.push_back({step, h.forward, h.backward});
  return later;
}

void add_returns(const Returns& returns, Belief& belief) {
  const double elsewhere = belief.elsewhere();
  for (const auto& [step, probability] : returns) {
    const double share = probability * elsewhere;
    Hypothesis& at = hypothesis_at(belief.places, step);
    at.forward += share;
    at.backward += share;
  }
}

Belief one_step_earlier(const Belief& belief, const Belief& prior, const Returns& returns,
                        const Belief& later) {
  const Ratios ratios(prior, returns, later);
  Belief earlier = belief;
  double sum = belief.elsewhere() * ratios.away();
  for (Hypothesis& h : earlier.places) {
    const auto near = ratios.around(h.step);
    double forward = 0;
    double backward = 0;
    for (std::size_t moved = 0; moved < kMoves.size(); ++moved) {
      forward += kMoves[moved] * near[kMaxMove + moved].forward;
      backward += kMoves[moved] * near[kMaxMove - moved].backward;
    }
    const double turned = kTurn * (forward + backward);
    const double left = prior.leave * ratios.away();
    h.forward *= (1 - prior.leave) * ((1 - 2 * kTurn) * forward + turned) + left;
    h.backward *= (1 - prior.leave) * ((1 - 2 * kTurn) * backward + turned) + left;
    sum += h.probability();
  }
  if (sum <= 0) return {};
  for (Hypothesis& h : earlier.places) {
    h.forward /= sum;
    h.backward /= sum;
  }
  return earlier;
}

}  // namespace loopbit
