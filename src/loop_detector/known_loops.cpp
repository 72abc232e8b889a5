// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "known_loops.hpp"

#include <iterator>
#include <utility>

namespace loopbit {
namespace {

/// Not every frame of a lap is found to be a revisit; those between two that were are.
constexpr std::ptrdiff_t kMaxStepsToLoop = 10;

}  // namespace

void KnownLoops::add(std::ptrdiff_t step, std::ptrdiff_t earlier_step) {
  const std::ptrdiff_t first = first_visit(earlier_step);
  const bool is_new = loops_.try_emplace(step, Loop{earlier_step, first}).second;
  if (is_new) steps_.emplace(first, step);
}

void KnownLoops::take(KnownLoops& others) {
  while (!others.loops_.empty()) {
    auto node = others.loops_.extract(others.loops_.begin());
    auto step = others.steps_.extract(others.steps_.begin());  // of any, for its memory
    step.mapped() = node.key();
    step.key() = node.mapped().first_visit = first_visit(node.mapped().earlier_step);
    if (loops_.insert(std::move(node)).inserted) steps_.insert(std::move(step));
  }
}

void KnownLoops::remove(std::ptrdiff_t step, std::ptrdiff_t earlier_step) {
  const auto found = loops_.find(step);
  if (found == loops_.end() || found->second.earlier_step != earlier_step) return;
  loops_.erase(found);
  // Later loops may have led to the same first visit through this one.
  KnownLoops others;
  others.loops_.swap(loops_);
  others.steps_.swap(steps_);
  take(others);
}

std::optional<std::ptrdiff_t> KnownLoops::first_visit_of(std::ptrdiff_t step) const {
  const auto found = loops_.find(step);
  return found == loops_.end() ? std::nullopt : std::optional(found->second.first_visit);
}

std::ptrdiff_t KnownLoops::first_visit(std::ptrdiff_t step) const {
  std::ptrdiff_t nearest = kMaxStepsToLoop + 1;
  std::ptrdiff_t first = step;
  const auto after = loops_.lower_bound(step);
  if (after != loops_.begin()) {
    const auto before = std::prev(after);
    if (step - before->first < nearest) {
      nearest = step - before->first;
      first = before->second.first_visit;
    }
  }
  if (after != loops_.end() && after->first - step < nearest) first = after->second.first_visit;
  return first;
}

}  // namespace loopbit
