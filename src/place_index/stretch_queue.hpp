// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "place_store.hpp"

namespace loopbit {

/// A stretch whose places overlap the query by at most `sum`, at a max(|query|, |O|) of at least
/// `larger_count`, which is not 0.
struct Stretch {
  std::uint32_t number;
  std::uint16_t sum;
  std::uint16_t larger_count;
  std::uint16_t shifts;  ///< a bit for each group of shifts that may matter
};

/// Stretches that wait to be looked into, by their bounds on xi, in steps of 1 / 64. Steps hold
/// enough stretches for memory to be read ahead, and few that a better order would spare.
class StretchQueue {
 public:
  StretchQueue() {
    for (auto& step : first_) step.fill(kNone);
  }

  /// Constant time.
  void push(std::size_t level, const Stretch& stretch) {
    const std::size_t step = step_of(stretch);
    std::uint32_t& first = first_[step][level];
    std::uint32_t node = free_;
    if (node == kNone) {
      node = static_cast<std::uint32_t>(nodes_.size());
      nodes_.push_back({stretch, first});
    } else {
      free_ = nodes_[node].next;
      nodes_[node] = {stretch, first};
    }
    first = node;
    highest_ = std::max(highest_, step);
  }

  /// Takes those of the highest step that are of the coarsest level there, and returns that level.
  /// Takes none if no bound is left that may be `least` or more.
  std::size_t pop(double least, std::vector<Stretch>& taken) {
    taken.clear();
    for (;; --highest_) {
      // No bound in a step is larger than where the next one begins.
      if (static_cast<double>(highest_ + 1) / kSteps < least) return 0;
      for (std::size_t level = 0; level < kStretchPlaces.size(); ++level) {
        if (first_[highest_][level] == kNone) continue;
        take(first_[highest_][level], taken);
        return level;
      }
      if (highest_ == 0) return 0;
    }
  }

 private:
  static constexpr unsigned kSteps = 64;
  static constexpr std::uint32_t kNone = UINT32_MAX;

  struct Node {
    Stretch stretch;
    std::uint32_t next;  ///< of its step and level, or of the free ones
  };

  /// Bounds of 1 and above share a step.
  static std::size_t step_of(const Stretch& stretch) {
    const unsigned sum = std::min(stretch.sum, stretch.larger_count);
    return sum * kSteps / stretch.larger_count;
  }

  void take(std::uint32_t& first, std::vector<Stretch>& taken) {
    std::uint32_t last = first;
    for (std::uint32_t node = first; node != kNone; node = nodes_[node].next) {
      taken.push_back(nodes_[node].stretch);
      last = node;
    }
    nodes_[last].next = free_;
    free_ = first;
    first = kNone;
  }

  std::vector<Node> nodes_;
  std::array<std::array<std::uint32_t, kStretchPlaces.size()>, kSteps + 1> first_;  ///< nodes
  std::uint32_t free_ = kNone;
  std::size_t highest_ = 0;  ///< no step above it has any
};

}  // namespace loopbit
