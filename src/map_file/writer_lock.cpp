// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "writer_lock.hpp"

#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "loopbit/error.hpp"
#include "loopbit/write_file.hpp"

namespace loopbit {
namespace {

std::string lock_path(const std::string& map_path) { return resolved_path(map_path) + ".lock"; }

/// False if the file was removed, or replaced, after it was opened.
bool is_still_at(const std::string& path, int file) {
  struct stat opened {};
  struct stat named {};
  return fstat(file, &opened) == 0 && stat(path.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

}  // namespace

WriterLock::WriterLock(const std::string& map_path) : path_(lock_path(map_path)) {
  constexpr mode_t kMode = 0666;  // less what umask takes
  do {
    if (file_ >= 0) close(file_);
    file_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kMode);
    if (file_ < 0) throw cannot_write(path_, errno);
    if (flock(file_, LOCK_EX | LOCK_NB) != 0) {
      const int reason = errno;
      close(file_);
      if (reason != EWOULDBLOCK) throw cannot_write(path_, reason);
      throw Error(ErrorKind::output,
                  fmt::format("'{}' is being written by another run; wait until that ends, or name "
                              "another map. Reading it is possible all the time.",
                              map_path));
    }
  } while (!is_still_at(path_, file_));
}

WriterLock::~WriterLock() {
  unlink(path_.c_str());
  close(file_);
}

bool is_being_written(const std::string& map_path) {
  const int file = open(lock_path(map_path).c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool is_locked = flock(file, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  close(file);
  return is_locked;
}

}  // namespace loopbit
