// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "known_loops.hpp"

#include <iterator>

namespace loopbit {
namespace {

/// Not every frame of a lap is found to be a revisit; those between two that were are.
constexpr std::ptrdiff_t kMaxStepsToLoop = 10;

}  // namespace

void KnownLoops::add(std::ptrdiff_t step, std::ptrdiff_t earlier_step) {
  first_visits_.try_emplace(step, first_visit(earlier_step));
}

std::ptrdiff_t KnownLoops::first_visit(std::ptrdiff_t step) const {
  std::ptrdiff_t nearest = kMaxStepsToLoop + 1;
  std::ptrdiff_t first = step;
  const auto after = first_visits_.lower_bound(step);
  if (after != first_visits_.begin()) {
    const auto before = std::prev(after);
    if (step - before->first < nearest) {
      nearest = step - before->first;
      first = before->second;
    }
  }
  if (after != first_visits_.end() && after->first - step < nearest) first = after->second;
  return first;
}

}  // namespace loopbit
