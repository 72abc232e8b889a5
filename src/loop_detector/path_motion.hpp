// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <numeric>
#include <optional>
#include <vector>

namespace loopbit {

/// A robot follows an earlier path at the pace of before, at a slower or at a faster one.
inline constexpr std::size_t kNumPaces = 3;
/// Forward at each pace, and then backward.
inline constexpr std::size_t kNumMotions = 2 * kNumPaces;

/// That the robot is at a step of the past, and moves along it.
struct Hypothesis {
  std::ptrdiff_t step = 0;
  std::array<double, kNumMotions> by_motion{};

  [[nodiscard]] double probability() const {
    return std::accumulate(by_motion.begin(), by_motion.end(), 0.0);
  }
  void multiply(double factor) {
    for (double& probability : by_motion) probability *= factor;
  }
};

/// At most so many steps of a path per step.
inline constexpr std::ptrdiff_t kMaxMove = 4;

/// How likely it is to move by 0, 1, 2 steps, and so on, for each motion.
using Moves = std::array<std::array<double, kMaxMove + 1>, kNumMotions>;

/// From a step of the past.
struct MovesFrom {
  std::ptrdiff_t step = 0;
  Moves moves{};
};

/// A probability for each of a few steps, in their order; the rest is somewhere new.
struct Belief {
  std::vector<Hypothesis> places;
  double leave = 0;  ///< if predicted: the probability that the robot has just left its path
  /// If predicted with odometry: the moves from each step where it is known.
  std::vector<MovesFrom> moves = {};

  [[nodiscard]] double elsewhere() const;
  [[nodiscard]] double at(std::ptrdiff_t step) const;
  /// The step with most probability.
  [[nodiscard]] std::optional<std::ptrdiff_t> peak() const;
};

/// That a robot elsewhere returns to a step, in each direction.
struct Return {
  std::ptrdiff_t step = 0;
  double probability = 0;
};

/// To each of some steps, in their order.
using Returns = std::vector<Return>;

/// To `step`; 0 where it is not among them.
double probability_at(const Returns& returns, std::ptrdiff_t step);

/// The hypothesis of a step, which is inserted if there is none. `places`: in the order of steps.
Hypothesis& hypothesis_at(std::vector<Hypothesis>& places, std::ptrdiff_t step);

// How a robot moves: it follows an earlier path forward or backward at some pace, turns round on
// it, leaves it, or returns anywhere. docs/method.md, section 4, has the model.

/// At the pace of before, a path moves by so many steps per step, at most.
inline constexpr std::ptrdiff_t kUsualMove = 2;

/// `num_steps`: how many there are to return to. `steps`: those that were looked at.
/// `weight(step)`: 0 to 1, how well the return agrees with odometry.
Returns returns_to(std::vector<std::ptrdiff_t> steps, std::ptrdiff_t num_steps,
                   const std::function<double(std::ptrdiff_t)>& weight);

/// That a robot which returns does so to a certain one of `num_steps` steps.
double from_anywhere(std::ptrdiff_t num_steps);

/// How long the robot has followed the path that it follows now.
struct Followed {
  double steps = 0;
  double independent = 0;  ///< what they are worth in independent witnesses, see WrongPaths
};

/// The probability that the robot leaves its path at the next step. `independence`: how many
/// independent witnesses that step is worth.
double leave_probability(double independence, const Followed& followed);

/// For a move by -kMaxMove to kMaxMove steps along a path.
using OfMoves = std::array<double, 2 * kMaxMove + 1>;

/// How well odometry agrees, 0 to 1, with each move from a step of the past. None: it does not
/// tell.
using AgreementOfMoves = std::function<std::optional<OfMoves>(std::ptrdiff_t step)>;

/// Where the robot is one step later, if it follows a path and leaves it with probability `leave`.
/// `agreement`: null = there is no odometry.
Belief one_step_later(const Belief& belief, double leave, const AgreementOfMoves& agreement = {});

/// Adds what a robot elsewhere may return to.
void add_returns(const Returns& returns, Belief& belief);

/// The reverse: where the robot was at a step, from what is known one step later. `belief`: after
/// the step's frame. `prior`: predicted from it for one step later. `later`: after all frames.
/// Rauch, Tung and Striebel's smoother (1965) for discrete states.
Belief one_step_earlier(const Belief& belief, const Belief& prior, const Returns& returns,
                        const Belief& later);

}  // namespace loopbit
