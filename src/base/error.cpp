// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/error.hpp"

#include <cstring>

#include <fmt/format.h>

namespace loopbit {

Error cannot_write(const std::string& path, int errno_value, const std::string& kept) {
  return {ErrorKind::output,
          fmt::format("Cannot write '{}': {}; check the folder, its permissions and the free "
                      "space.{}",
                      path, std::strerror(errno_value), kept)};
}

}  // namespace loopbit
