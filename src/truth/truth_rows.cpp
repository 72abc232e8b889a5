// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "truth_rows.hpp"

#include <algorithm>

namespace loopbit::truth {
namespace {

/// The sequence has at most so many frames, where all that it has were read.
std::size_t most_frames(const FramesRead& frames) {
  return frames.times_s.size() * static_cast<std::size_t>(frames.every);
}

}  // namespace

bool has_times(const FramesRead& frames) {
  return std::ranges::any_of(frames.times_s, [](const auto& time) { return time.has_value(); });
}

void check_pose_each(const std::string& path, std::size_t poses, const FramesRead& frames) {
  const auto step = static_cast<std::size_t>(frames.every);
  if ((poses + step - 1) / step == frames.times_s.size()) return;
  throw Error(ErrorKind::input,
              fmt::format("'{}' tells {} poses by time, but the {} frames read have no times to "
                          "tell which belong together: give the folder or list of the sequence "
                          "that has its times, or one pose a frame.",
                          path, poses, frames.times_s.size()));
}

void check_rows(const std::string& path, std::size_t rows, const char* things,
                const FramesRead& frames) {
  if (frames.times_s.empty()) return;
  const std::size_t last = (frames.times_s.size() - 1) * static_cast<std::size_t>(frames.every);
  if (last >= rows) {
    throw Error(ErrorKind::input,
                fmt::format("'{}' has {} {}, but the sequence has {} frames: give the file of "
                            "this sequence, with all its frames where some are left out.",
                            path, rows, things, last + 1));
  }
  if (!frames.all || rows <= most_frames(frames)) return;
  throw Error(ErrorKind::input,
              fmt::format("'{}' has {} {}, but the sequence has {} frames: give the file of this "
                          "sequence, without rows for frames that it does not have.",
                          path, rows, things, most_frames(frames)));
}

void check_frame(const std::string& path, int frame, const FramesRead& frames) {
  if (!frames.all || frames.times_s.empty()) return;
  if (static_cast<std::size_t>(frame) < most_frames(frames)) return;
  throw Error(ErrorKind::input,
              fmt::format("'{}' tells of frame {}, but the sequence has {} frames, counted from 0: "
                          "give the file of this sequence, without frames that it does not have.",
                          path, frame, most_frames(frames)));
}

}  // namespace loopbit::truth
