// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>

namespace loopbit::cli {

/// From now on, a first SIGINT, SIGTERM or SIGHUP turns the result true; a second one ends the
/// process. SIGHUP stays ignored if it was.
const std::atomic<bool>& stop_on_signal();

}  // namespace loopbit::cli
