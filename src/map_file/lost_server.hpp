// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <chrono>

#include "loopbit/error.hpp"
#include "loopbit/map_database.hpp"

namespace loopbit {

/// A server that restarts after a crash of its machine is back within a minute or two.
inline constexpr std::chrono::minutes kMaxAbsence{2};
inline constexpr std::chrono::milliseconds kFirstPause{100};
inline constexpr std::chrono::milliseconds kMaxPause{5000};

/// Waits by `pause` until the server of a map is reached again. False if it is not after
/// kMaxAbsence, or if pause(duration) returns false.
template <typename Pause>
bool reach_again(MapDatabase& database, const Pause& pause) {
  const auto end = std::chrono::steady_clock::now() + kMaxAbsence;
  for (auto next = kFirstPause; database.is_lost(); next = std::min(2 * next, kMaxPause)) {
    if (std::chrono::steady_clock::now() > end || !pause(next)) return false;
    try {
      database.reconnect();
    } catch (const Error&) {  // it is still away
    }
  }
  return true;
}

/// Calls action(), and again if the server of a map was lost meanwhile and is reached again. Throws
/// the action's Error otherwise. Returns how often the server was lost.
template <typename Pause, typename Action>
int despite_lost_server(MapDatabase& database, const Pause& pause, const Action& action) {
  for (int times = 0;; ++times) {
    try {
      action();
      return times;
    } catch (const Error&) {
      if (!database.is_lost() || !reach_again(database, pause)) throw;
    }
  }
}

}  // namespace loopbit
