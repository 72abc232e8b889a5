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

struct Pace {
  double share;                            ///< of the robots that return
  std::array<double, kMaxMove + 1> moves;  ///< see Moves
};

/// Most robots keep the pace of before, or images come as often. One that drives at half of it or
/// at three times as fast does so for long.
constexpr std::array<Pace, kNumPaces> kPaces{
    {{0.6, {0.25, 0.5, 0.25}}, {0.2, {0.5, 0.5}}, {0.2, {0, 0, 0.25, 0.5, 0.25}}}};
/// Robots seldom turn round on a path.
constexpr double kTurn = 0.01;
/// As seldom, they take another pace.
constexpr double kNewPace = 0.01;
/// As seldom, odometry tells nothing of a move: wheels slip, or the path is seen from elsewhere.
constexpr double kOdometryFails = 0.01;

constexpr const Pace& pace_of(std::size_t motion) { return kPaces.at(motion % kNumPaces); }

constexpr std::ptrdiff_t direction_of(std::size_t motion) { return motion < kNumPaces ? 1 : -1; }

/// The probability that a robot goes on with motion `next`, if it stays on its path.
constexpr double goes_on(std::size_t motion, std::size_t next) {
  if (motion == next) return 1 - kTurn - kNewPace * (1 - pace_of(next).share);
  if (direction_of(motion) == direction_of(next)) return kNewPace * pace_of(next).share;
  return motion % kNumPaces == next % kNumPaces ? kTurn : 0;
}

/// The item of `step`, or the end. `items`: in the order of steps.
template <typename Items>
auto item_at(const Items& items, std::ptrdiff_t step) {
  using Item = typename Items::value_type;
  const auto found = std::ranges::lower_bound(items, step, {}, &Item::step);
  return found != items.end() && found->step == step ? found : items.end();
}

/// The index of a move in OfMoves, and of where it leads in Ratios::around().
std::size_t move_index(std::size_t motion, std::size_t moved) {
  return static_cast<std::size_t>(kMaxMove +
                                  direction_of(motion) * static_cast<std::ptrdiff_t>(moved));
}

constexpr Moves moves_at_all_paces() {
  Moves moves{};
  for (std::size_t m = 0; m < kNumMotions; ++m) moves.at(m) = pace_of(m).moves;
  return moves;
}
constexpr Moves kMoves = moves_at_all_paces();

/// Odometry tells how far the robot has moved, so paces count only where it fails. None: it does
/// not tell.
std::optional<Moves> moves_by(const AgreementOfMoves& agreement, std::ptrdiff_t step) {
  const auto agrees = agreement(step);
  if (!agrees) return std::nullopt;
  Moves moves = kMoves;
  for (std::size_t m = 0; m < kNumMotions; ++m) {
    double sum = 0;
    for (std::size_t moved = 0; moved <= kMaxMove; ++moved) {
      double& move = moves[m][moved];
      move = kOdometryFails * move +
             (1 - kOdometryFails) * (*agrees)[move_index(m, moved)] / (kMaxMove + 1);
      sum += move;
    }
    for (double& move : moves[m]) move /= sum;
  }
  return moves;
}

/// Of each state one step later, its probability after all frames by its predicted one.
class Ratios {
 public:
  Ratios(const Belief& prior, const Returns& returns, const Belief& later) {
    const double elsewhere = prior.elsewhere();
    double away = 1;
    const double new_ratio = elsewhere > 0 ? later.elsewhere() / elsewhere : 0.0;
    for (const Hypothesis& h : prior.places) ratios_.push_back({h.step, {}});
    for (const Hypothesis& h : later.places) {
      const auto known = item_at(prior.places, h.step);
      if (known == prior.places.end()) continue;
      Hypothesis& ratio = ratios_[static_cast<std::size_t>(known - prior.places.begin())];
      for (std::size_t m = 0; m < kNumMotions; ++m) {
        if (known->by_motion[m] > 0) ratio.by_motion[m] = h.by_motion[m] / known->by_motion[m];
      }
    }
    for (const auto& [step, probability] : returns) {
      const auto there = item_at(ratios_, step);
      if (there == ratios_.end()) continue;
      away -= 2 * probability;
      for (std::size_t m = 0; m < kNumMotions; ++m) {
        away_ += probability * pace_of(m).share * there->by_motion[m];
      }
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
      h.step = step - kMaxMove + (&h - near.data());
      h.by_motion.fill(away_);
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

/// The mean of a rate that is not known, as if half a path had ended in half of the usual number of
/// steps: Jeffreys' prior of a rate is half an event. The longer the robot has followed its path,
/// the longer that is expected to go on.
double leave_probability(double independence, const Followed& followed) {
  return std::min(1 / (kUsualSteps + 2 * followed.steps),
                  independence / (kUsualIndependent + 2 * followed.independent));
}

Belief one_step_later(const Belief& belief, double leave, const AgreementOfMoves& agreement) {
  std::map<std::ptrdiff_t, Hypothesis> next;
  Belief later{.places = {}, .leave = leave};
  for (const Hypothesis& h : belief.places) {
    const auto by_odometry = agreement ? moves_by(agreement, h.step) : std::nullopt;
    if (by_odometry) later.moves.push_back({h.step, *by_odometry});
    const Moves& moves = by_odometry ? *by_odometry : kMoves;
    for (std::size_t m = 0; m < kNumMotions; ++m) {
      double stays = 0;
      for (std::size_t before = 0; before < kNumMotions; ++before) {
        stays += goes_on(before, m) * h.by_motion[before];
      }
      if (stays == 0) continue;
      for (std::ptrdiff_t moved = 0; moved <= kMaxMove; ++moved) {
        const double probability = moves[m][static_cast<std::size_t>(moved)];
        if (probability == 0) continue;
        Hypothesis& there = next[h.step + direction_of(m) * moved];
        there.by_motion[m] += probability * (1 - leave) * stays;
      }
    }
  }
  later.places.reserve(next.size());
  for (const auto& [step, h] : next) later.places.push_back({step, h.by_motion});
  return later;
}

void add_returns(const Returns& returns, Belief& belief) {
  const double elsewhere = belief.elsewhere();
  for (const auto& [step, probability] : returns) {
    const double share = probability * elsewhere;
    Hypothesis& at = hypothesis_at(belief.places, step);
    for (std::size_t m = 0; m < kNumMotions; ++m) at.by_motion[m] += pace_of(m).share * share;
  }
}

Belief one_step_earlier(const Belief& belief, const Belief& prior, const Returns& returns,
                        const Belief& later) {
  const Ratios ratios(prior, returns, later);
  Belief earlier = belief;
  double sum = belief.elsewhere() * ratios.away();
  for (Hypothesis& h : earlier.places) {
    const auto near = ratios.around(h.step);
    const auto by_odometry = item_at(prior.moves, h.step);
    const Moves& moves = by_odometry == prior.moves.end() ? kMoves : by_odometry->moves;
    std::array<double, kNumMotions> after{};
    for (std::size_t m = 0; m < kNumMotions; ++m) {
      for (std::size_t moved = 0; moved <= kMaxMove; ++moved) {
        after[m] += moves[m][moved] * near[move_index(m, moved)].by_motion[m];
      }
    }
    for (std::size_t m = 0; m < kNumMotions; ++m) {
      double stays = 0;
      for (std::size_t next = 0; next < kNumMotions; ++next)
        stays += goes_on(m, next) * after[next];
      h.by_motion[m] *= (1 - prior.leave) * stays + prior.leave * ratios.away();
    }
    sum += h.probability();
  }
  if (sum <= 0) return {};
  for (Hypothesis& h : earlier.places) h.multiply(1 / sum);
  return earlier;
}

}  // namespace loopbit
