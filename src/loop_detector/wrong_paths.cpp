// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "wrong_paths.hpp"

#include <algorithm>
#include <utility>

namespace loopbit {
namespace {

/// A path lasts for 32 steps, as for late loops.
constexpr double kFading = 31.0 / 32.0;

}  // namespace

double WrongPaths::independence() const { return std::min(1.0, square_sums_ / sum_sq_); }

WrongPaths::Next WrongPaths::prepare(const ByStep& wrong) const {
  Next next;
  next.paths.reserve(wrong.size());
  for (const auto& [step, deviation] : wrong) {
    const auto before = next_to(
        paths_, step, [](const Path& path) { return path.step; },
        [](const Path& a, const Path& b) { return a.sum > b.sum; });
    Path path{.step = step, .sum = deviation, .weight = 1};
    if (before != paths_.end()) {
      path.sum += kFading * before->sum;
      path.weight += kFading * kFading * before->weight;
    }
    next.sum_sq += path.sum * path.sum;
    next.square_sums += path.weight * deviation * deviation;
    next.paths.push_back(path);
  }
  return next;
}

void WrongPaths::commit(Next next) noexcept {
  paths_ = std::move(next.paths);
  sum_sq_ += next.sum_sq;
  square_sums_ += next.square_sums;
}

}  // namespace loopbit
