// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>

namespace loopbit {

/// How soon a server is tried again, doubled each time: robots should learn of each other within a
/// second, also after it was away.
inline constexpr std::chrono::milliseconds kFirstPause{100};
inline constexpr std::chrono::milliseconds kMaxPause{1000};

/// An answer of a few kilobytes that takes longer does not come.
inline constexpr std::chrono::milliseconds kMaxAnswer{10000};

}  // namespace loopbit
