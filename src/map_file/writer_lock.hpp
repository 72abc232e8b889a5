// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace loopbit {

/// The right to write one map, for as long as this lives. Held on a file `MAP.lock` beside it,
/// through all symbolic links, by flock(2): the system gives it up when a process ends, however it
/// ends, so none is ever stale.
class WriterLock {
 public:
  /// Throws Error (kind output) if another process, or this one, writes the map, or the file cannot
  /// be made.
  explicit WriterLock(const std::string& map_path);
  ~WriterLock();
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;
  WriterLock(WriterLock&&) = delete;
  WriterLock& operator=(WriterLock&&) = delete;

 private:
  std::string path_;
  int file_ = -1;
};

/// Whether a process, this one or another, holds the lock of the map.
bool is_being_written(const std::string& map_path);

}  // namespace loopbit
