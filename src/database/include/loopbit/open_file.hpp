// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>

#include <sys/types.h>

namespace loopbit {

/// A file that this process uses, and the right to write it. The right belongs to the file itself,
/// not to one of its names, and the system takes it back when the process ends, however it ends.
///
/// SQLite's own locks are lost as soon as the process closes any descriptor of the file. So each
/// file has one descriptor here, which is closed when the last OpenFile of it is gone; a Database
/// holds one.
class OpenFile {
 public:
  /// Throws Error (kind input) if there is no file.
  explicit OpenFile(const std::string& path);
  /// Gives up the right to write.
  ~OpenFile();
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  OpenFile(OpenFile&&) = delete;
  OpenFile& operator=(OpenFile&&) = delete;

  /// Takes the right to write. False if another OpenFile has it, of this process or another. Throws
  /// Error (kind output) if the file may not be written.
  [[nodiscard]] bool lock();

  /// Whether anybody has the right to write.
  [[nodiscard]] bool is_locked() const;

  /// False if the path names another file by now.
  [[nodiscard]] bool is_at_its_path() const;

 private:
  using Key = std::pair<dev_t, ino_t>;

  std::string path_;
  Key key_;
  bool has_lock_ = false;
};

}  // namespace loopbit
