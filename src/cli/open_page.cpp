// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "open_page.hpp"

#include <array>

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "loopbit/error.hpp"

namespace loopbit::cli {

void open_page(const std::string& path) {
  std::string program = "xdg-open";
  std::string argument = path;
  std::array<char*, 3> arguments{program.data(), argument.data(), nullptr};
  pid_t process = 0;
  int status = 0;
  const bool started =
      posix_spawnp(&process, program.c_str(), nullptr, nullptr, arguments.data(), environ) == 0;
  if (!started || waitpid(process, &status, 0) != process || status != 0) {
    throw Error(ErrorKind::output,
                fmt::format("'{}' is written, but no browser could be opened by xdg-open; open it "
                            "by hand.",
                            path));
  }
}

}  // namespace loopbit::cli
