// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <chrono>
#include <utility>

namespace loopbit {

/// An answer of a few kilobytes that takes longer does not come.
inline constexpr std::chrono::milliseconds kMaxAnswer{10000};

/// How soon a server is tried again: robots should learn of each other within a second, also after
/// it was away.
class RetryPause {
 public:
  /// Twice as long each time, up to a limit.
  std::chrono::milliseconds next() { return std::exchange(pause_, std::min(2 * pause_, kMost)); }
  void reset() { pause_ = kFirst; }

 private:
  static constexpr std::chrono::milliseconds kFirst{100};
  static constexpr std::chrono::milliseconds kMost{1000};
  std::chrono::milliseconds pause_ = kFirst;
};

}  // namespace loopbit
