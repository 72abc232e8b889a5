// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <string>
#include <string_view>

namespace loopbit {

/// `text` on one line that cannot steer a terminal: control characters, which file names may
/// contain, are written as "\x1b". The rest stays as it is.
std::string printable(std::string_view text);

/// The same JSON, fit for a terminal: DEL and C1, which JSON permits in strings, are written as
/// "\u007f".
std::string printable_json(std::string_view json);

/// "1 frame", "2 frames".
std::string counted(std::integral auto number, std::string_view thing) {
  return std::to_string(number).append(" ").append(thing).append(number == 1 ? "" : "s");
}

}  // namespace loopbit
