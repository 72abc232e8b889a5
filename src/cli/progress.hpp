// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

namespace loopbit::cli {

/// Tells on stderr how far a run is: one line that renews itself on a terminal, else a plain line
/// every few seconds.
class Progress {
 public:
  /// `total`: frames in all, where known. `of_detection`: loops are counted, too.
  explicit Progress(std::optional<std::size_t> total, bool of_detection = true);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  Progress(Progress&&) = delete;
  Progress& operator=(Progress&&) = delete;

  /// One frame more is done; `is_loop` counts it among the loops.
  void advance(bool is_loop);

  /// A sentence about a bad frame. After the first few they are only counted.
  void report(const std::string& sentence);

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] std::string line() const;
  [[nodiscard]] std::string bar() const;
  void clear_line() const;

  const std::optional<std::size_t> total_;
  const bool of_detection_;
  const bool on_terminal_;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point last_shown_ = start_;
  std::size_t frames_ = 0;
  std::size_t loops_ = 0;
  std::size_t reports_ = 0;
};

}  // namespace loopbit::cli
