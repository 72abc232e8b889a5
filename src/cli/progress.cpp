// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "progress.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <unistd.h>

#include "loopbit/printable.hpp"

#include "process.hpp"

namespace loopbit::cli {
namespace {

using std::chrono::duration;

constexpr duration<double> kTerminalPause{0.1};
constexpr duration<double> kPlainPause{5.0};
constexpr std::size_t kBarWidth = 24;
constexpr std::size_t kMaxReports = 10;

std::string clock_time(double seconds) {
  const long whole = std::lround(seconds);
  if (whole < 3600) return fmt::format("{}:{:02}", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

}  // namespace

Progress::Progress(std::optional<std::size_t> total, Style style)
    : total_(total), style_(style), on_terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  clear_line();
  if (reports_ > kMaxReports) {
    tell(fmt::format("loopbit: {} frames were unreadable in all; loops.csv lists them.\n",
                     reports_));
  }
}

void Progress::advance(bool is_loop) {
  ++frames_;
  if (is_loop) ++loops_;
  if (!style_.shown) return;
  const auto now = Clock::now();
  if (now - last_shown_ < (on_terminal_ ? kTerminalPause : kPlainPause)) return;
  last_shown_ = now;
  clear_line();
  tell(line() + (on_terminal_ ? "" : "\n"));
}

void Progress::report(const std::string& sentence) {
  if (++reports_ <= kMaxReports) note(sentence);
}

void Progress::note(const std::string& sentence) {
  clear_line();
  tell(fmt::format("loopbit: {}\n", sentence));
}

std::string Progress::line() const {
  const double elapsed_s = duration<double>(Clock::now() - start_).count();
  const double rate = static_cast<double>(frames_) / std::max(elapsed_s, 1e-9);
  std::array<std::string, 4> facts;
  auto& [count, speed, left, loops] = facts;
  count = total_ ? fmt::format("{} of {} frames", frames_, *total_) : counted(frames_, "frame");
  speed = fmt::format(", {:.1f} frames/s", rate);
  if (total_ && *total_ >= frames_) {
    left = fmt::format(", {} left", clock_time(static_cast<double>(*total_ - frames_) / rate));
  }
  if (style_.of_detection) loops = fmt::format(", {}", counted(loops_, "loop"));
  if (!on_terminal_) return fmt::format("{}", fmt::join(facts, ""));

  // One less than fits, because some terminals wrap a full line.
  const std::size_t room = terminal_columns(STDERR_FILENO) - 1;
  for (std::string* fact : {&speed, &loops, &left}) {
    if (fmt::format("{}", fmt::join(facts, "")).size() > room) fact->clear();
  }
  const std::string text = fmt::format("{}", fmt::join(facts, ""));
  return bar(room - std::min(room, text.size())) + text;
}

std::string Progress::bar(std::size_t room) const {
  constexpr std::size_t kAround = 3;  // brackets and a space
  constexpr std::size_t kLeastWidth = 6;
  if (!total_ || *total_ == 0 || room < kLeastWidth + kAround) return "";
  const std::size_t width = std::min(kBarWidth, room - kAround);
  const std::size_t full = std::min(width, frames_ * width / *total_);
  return fmt::format("[{}{}] ", std::string(full, '#'), std::string(width - full, '.'));
}

void Progress::clear_line() const {
  if (on_terminal_ && style_.shown) clear_terminal_line();
}

}  // namespace loopbit::cli
