// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "wrong_paths.hpp"

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <utility>

namespace loopbit {
namespace {

/// A path lasts for 32 steps, as for late loops.
constexpr double kFading = 31.0 / 32.0;
/// Places so close may follow the same place of the step before.
constexpr std::ptrdiff_t kOnePath = 2 * kUsualMove;

/// Of `paths`, the indices of those that count. Places side by side show the same, which is one
/// path: the one that is known longest counts.
std::vector<std::size_t> one_of_each(const std::vector<WrongPaths::Path>& paths) {
  std::vector<std::size_t> longest_first(paths.size());
  std::iota(longest_first.begin(), longest_first.end(), std::size_t{0});
  std::ranges::stable_sort(longest_first, std::greater{},
                           [&](std::size_t i) { return paths[i].weight; });
  std::vector<std::size_t> counted;
  for (const std::size_t i : longest_first) {
    const bool is_apart = std::ranges::all_of(counted, [&](std::size_t other) {
      return std::abs(paths[other].step - paths[i].step) > kOnePath;
    });
    if (is_apart) counted.push_back(i);
  }
  return counted;
}

}  // namespace

double WrongPaths::independence() const {
  return std::min(1.0, square_sums_.value() / sum_sq_.value());
}

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
    next.paths.push_back(path);
  }
  for (const std::size_t i : one_of_each(next.paths)) {
    const Path& path = next.paths[i];
    const double deviation = wrong[i].second;
    next.sum_sq += path.sum * path.sum;
    next.square_sums += path.weight * deviation * deviation;
  }
  return next;
}

void WrongPaths::commit(Next next) noexcept {
  paths_ = std::move(next.paths);
  sum_sq_.add(next.sum_sq);
  square_sums_.add(next.square_sums);
}

}  // namespace loopbit
