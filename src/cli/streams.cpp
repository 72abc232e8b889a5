// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "streams.hpp"

#include <cerrno>
#include <cstdio>

#include <fcntl.h>
#include <unistd.h>

#include "loopbit/error.hpp"
#include "loopbit/printable.hpp"

namespace loopbit::cli {

void keep_closed_streams_closed() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) != -1) continue;
    // Opened the wrong way round, so that using it still fails.
    (void)open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

void tell(const std::string& text) {
  (void)std::fputs(printable(text).c_str(), stderr);
  (void)std::fflush(stderr);
}

void flush_stdout() {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  // The reason of an earlier failure is not kept.
  throw cannot_write("standard output", errno != 0 ? errno : EIO);
}

}  // namespace loopbit::cli
