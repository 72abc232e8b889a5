// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "frames_read.hpp"

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit::datasets {

void check_pose_each(const std::string& path, std::size_t poses, std::size_t frames_read,
                     int every) {
  const auto step = static_cast<std::size_t>(every);
  if ((poses + step - 1) / step == frames_read) return;
  throw Error(ErrorKind::input,
              fmt::format("'{}' tells {} poses by time, but the {} frames read have no times to "
                          "tell which belong together: give the folder or list of the sequence "
                          "that has its times, or one pose a frame.",
                          path, poses, frames_read));
}

void check_rows(const std::string& path, std::size_t rows, const char* things,
                std::size_t frames_read, int every) {
  if (frames_read == 0) return;
  const std::size_t last = (frames_read - 1) * static_cast<std::size_t>(every);
  if (last < rows) return;
  throw Error(ErrorKind::input,
              fmt::format("'{}' has {} {}, but the sequence has {} frames: give the file of "
                          "this sequence, with all its frames where some are left out.",
                          path, rows, things, last + 1));
}

}  // namespace loopbit::datasets
