// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

namespace loopbit::cli {

/// Shows the progress of a run on stderr: a line that updates itself on a terminal, otherwise a
/// plain line every few seconds.
class Progress {
 public:
  struct Style {
    bool shown = true;         ///< false: only bad frames are reported
    bool of_detection = true;  ///< also counts loops
  };

  /// `total`: number of frames, if known.
  Progress(std::optional<std::size_t> total, Style style);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  Progress(Progress&&) = delete;
  Progress& operator=(Progress&&) = delete;

  /// Counts a frame; `is_loop` also counts a loop.
  void advance(bool is_loop);

  /// Prints a sentence about a bad frame. After the first few, they are only counted.
  void report(const std::string& sentence);

  /// Says something else.
  void note(const std::string& sentence);

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] std::string line() const;
  [[nodiscard]] std::string bar(std::size_t room) const;
  void clear_line() const;

  const std::optional<std::size_t> total_;
  const Style style_;
  const bool on_terminal_;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point last_shown_ = start_;
  std::size_t frames_ = 0;
  std::size_t loops_ = 0;
  std::size_t reports_ = 0;
};

}  // namespace loopbit::cli
