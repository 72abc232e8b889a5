// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <map>
#include <optional>

namespace loopbit {

/// The loops found so far, as knowledge of which stretches of the path are laps through one place.
/// Places that look alike are a warning, laps through one place are not; what tells them apart is
/// that each lap, when it was driven, was found to be a revisit.
class KnownLoops {
 public:
  /// A step of the path was found to show the same place as an earlier one.
  void add(std::ptrdiff_t step, std::ptrdiff_t earlier_step);

  /// Moves the loops of `others` here, without those of steps that have one here. Does not throw.
  void take(KnownLoops& others);

  /// Forgets that loop. Linear in the loops.
  void remove(std::ptrdiff_t step, std::ptrdiff_t earlier_step);

  /// The step of the first visit to the place that `step` shows, as far as loops at most 10 steps
  /// away tell; else `step` itself. Logarithmic in the loops.
  [[nodiscard]] std::ptrdiff_t first_visit(std::ptrdiff_t step) const;

  /// Calls visit(s) with `step`, and each step s before `end` that shows the same place, as far as
  /// loops to within 2 steps of it tell. Logarithmic in the loops.
  template <typename Visit>
  void for_each_visit(std::ptrdiff_t step, std::ptrdiff_t end, const Visit& visit) const {
    constexpr std::ptrdiff_t kNear = 2;  // a match is the nearest step or one beside it
    const std::ptrdiff_t first = first_visit_of(step).value_or(step);
    const auto last = steps_.upper_bound(first + kNear);
    visit(step);
    for (auto at = steps_.lower_bound(first - kNear); at != last; ++at) {
      if (at->second < end && at->second != step) visit(at->second);
    }
  }

  /// The step of the first visit, if `step` itself has a loop.
  [[nodiscard]] std::optional<std::ptrdiff_t> first_visit_of(std::ptrdiff_t step) const;

 private:
  struct Loop {
    std::ptrdiff_t earlier_step = 0;
    std::ptrdiff_t first_visit = 0;
  };

  std::map<std::ptrdiff_t, Loop> loops_;                 ///< by step
  std::multimap<std::ptrdiff_t, std::ptrdiff_t> steps_;  ///< of loops_, by first visit
};

}  // namespace loopbit
