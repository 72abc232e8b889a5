// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <vector>

#include <fmt/core.h>

namespace loopbit::bench {

/// Processor time of this thread, ms: what other programs on the machine take is left out, and so
/// is waiting for a disk.
inline double thread_ms() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// The value at this fraction (0 to 1) of the sorted values. There is at least one.
inline double percentile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  const auto at = std::lround(fraction * static_cast<double>(values.size() - 1));
  return values[static_cast<std::size_t>(at)];
}

/// The exit code of the benchmark `name`, whose main() calls `run()`. Prints what is thrown.
template <typename Run>
int run_main(const char* name, const Run& run) {
  try {
    run();
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
    return EXIT_FAILURE;
  }
}

}  // namespace loopbit::bench
