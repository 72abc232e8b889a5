// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/open_file.hpp"

#include <cerrno>
#include <cstring>
#include <map>
#include <mutex>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "loopbit/error.hpp"
#include "loopbit/write_file.hpp"

namespace loopbit {
namespace {

using Key = std::pair<dev_t, ino_t>;

/// What the open files with one key share.
struct Shared {
  int uses = 0;
  int descriptor = -1;
  pid_t process = 0;  ///< that opened the descriptor: a forked child needs one of its own
  bool is_locked = false;
};

struct Files {
  std::mutex mutex;
  std::map<Key, Shared> by_key;
};

Files& files() {
  static Files files;
  return files;
}

/// Far behind the bytes that SQLite locks (sqlite.org/src/file/src/os.h, PENDING_BYTE), which it
/// does from 1 GiB on.
struct flock writer_byte(short type) {
  struct flock byte {};
  byte.l_type = type;
  byte.l_whence = SEEK_SET;
  byte.l_start = off_t{1} << 62U;
  byte.l_len = 1;
  return byte;
}

/// False if there is none.
bool find_key(const std::string& path, Key& key) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return false;
  key = {status.st_dev, status.st_ino};
  return true;
}

void leave_to_parent(Shared& file) {
  if (file.process == getpid()) return;
  file = {.uses = file.uses, .process = getpid()};
}

/// errno says why it is false; 0: the path names another file by now.
bool open_descriptor(const std::string& path, int flags, const Key& key, Shared& file) {
  if (file.descriptor >= 0) return true;
  const int descriptor = open(path.c_str(), flags | O_CLOEXEC);
  if (descriptor < 0) return false;
  struct stat status {};
  if (fstat(descriptor, &status) == 0 && Key(status.st_dev, status.st_ino) == key) {
    file.descriptor = descriptor;
    return true;
  }
  errno = 0;  // and it stays open: closing it could take locks of SQLite on that file
  return false;
}

}  // namespace

OpenFile::OpenFile(const std::string& path) : path_(path) {
  if (!find_key(path, key_)) {
    throw Error(ErrorKind::input, fmt::format("'{}' cannot be read ({}): check the path.", path,
                                              std::strerror(errno)));
  }
  const std::lock_guard guard(files().mutex);
  ++files().by_key[key_].uses;
}

OpenFile::~OpenFile() {
  const std::lock_guard guard(files().mutex);
  const auto found = files().by_key.find(key_);
  Shared& file = found->second;
  leave_to_parent(file);
  if (has_lock_ && file.is_locked) {
    auto byte = writer_byte(F_UNLCK);  // a forked child may hold the descriptor, too
    fcntl(file.descriptor, F_OFD_SETLK, &byte);
    file.is_locked = false;
  }
  if (--file.uses > 0) return;
  if (file.descriptor >= 0) close(file.descriptor);
  files().by_key.erase(found);
}

bool OpenFile::lock() {
  const std::lock_guard guard(files().mutex);
  Shared& file = files().by_key.at(key_);
  leave_to_parent(file);
  if (file.is_locked) return false;
  auto byte = writer_byte(F_WRLCK);
  if (!open_descriptor(path_, O_RDWR, key_, file)) {
    if (errno == 0) return false;
    throw cannot_write(path_, errno);
  }
  if (fcntl(file.descriptor, F_OFD_SETLK, &byte) != 0) {
    if (errno == EAGAIN || errno == EACCES) return false;
    throw cannot_write(path_, errno);
  }
  file.is_locked = has_lock_ = true;
  return true;
}

bool OpenFile::is_locked() const {
  const std::lock_guard guard(files().mutex);
  Shared& file = files().by_key.at(key_);
  leave_to_parent(file);
  if (file.is_locked) return true;
  if (!open_descriptor(path_, O_RDWR, key_, file) &&
      !open_descriptor(path_, O_RDONLY, key_, file)) {
    return false;
  }
  auto byte = writer_byte(F_WRLCK);
  return fcntl(file.descriptor, F_OFD_GETLK, &byte) == 0 && byte.l_type != F_UNLCK;
}

bool OpenFile::is_at_its_path() const {
  Key key;
  return find_key(path_, key) && key == key_;
}

}  // namespace loopbit
