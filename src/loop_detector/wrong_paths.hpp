// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "path_motion.hpp"

namespace loopbit {

/// A value of each step, in the order of the steps.
using ByStep = std::vector<std::pair<std::ptrdiff_t, double>>;

/// A sum of what each step adds. Older steps fade, because surroundings change: what a campus
/// showed says little of the building behind it.
class FadingSum {
 public:
  /// `prior`: as long as nothing is known.
  explicit FadingSum(double prior) : prior_(prior), value_(prior) {}

  [[nodiscard]] double value() const { return value_; }
  /// What a step adds.
  void add(double more) noexcept { value_ += more - (value_ - prior_) / kSteps; }

 private:
  /// A step counts for so many steps on average.
  static constexpr double kSteps = 200;

  double prior_;
  double value_;
};

/// How long the deviations of wrong places last along a path, measured on this map. A street that
/// looks like another one does so for many steps, and these are not as many independent witnesses.
/// The more often a camera takes an image, the more steps a street has, and the less each counts.
/// docs/method.md, section 4, has the formula.
class WrongPaths {
 public:
  /// How many independent witnesses one step of a path is worth, above 0 and at most 1: the
  /// variance that sums of deviations along a path would have if the steps were independent, over
  /// the one that they have.
  [[nodiscard]] double independence() const;

  /// Deviations of steps that follow each other, summed up; older ones fade.
  struct Path {
    std::ptrdiff_t step = 0;
    double sum = 0;
    double weight = 0;  ///< the variance of `sum` if the steps were independent
  };

  /// What commit() changes.
  struct Next {
    std::vector<Path> paths = {};
    double sum_sq = 0;
    double square_sums = 0;
  };

  /// `wrong`: the deviations of steps where the robot is not.
  [[nodiscard]] Next prepare(const ByStep& wrong) const;

  void commit(Next next) noexcept;

 private:
  std::vector<Path> paths_;  ///< that end at the latest step
  FadingSum sum_sq_{300};    ///< of `sum`; as if one step in three were independent
  FadingSum square_sums_{100};
};

/// Of `items`, the best by `is_better(a, b)` of those whose step, `step_of(item)`, comes before or
/// after `step` on a path: a path moves by one or two steps per step. A robot that stands still
/// sees the same features again, which tells nothing.
template <typename Items, typename StepOf, typename IsBetter>
auto next_to(const Items& items, std::ptrdiff_t step, const StepOf& step_of,
             const IsBetter& is_better) {
  constexpr std::ptrdiff_t kMinMove = 1;
  auto best = items.end();
  for (auto at = items.begin(); at != items.end(); ++at) {
    const std::ptrdiff_t ahead = step_of(*at) - step;
    const std::ptrdiff_t move = ahead < 0 ? -ahead : ahead;
    if (move < kMinMove || move > kUsualMove) continue;
    if (best == items.end() || is_better(*at, *best)) best = at;
  }
  return best;
}

}  // namespace loopbit
