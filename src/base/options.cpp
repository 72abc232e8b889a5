// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/options.hpp"

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {

void check_range(std::string_view section, std::string_view name, double value, double min,
                 double max) {
  if (value >= min && value <= max) return;
  throw Error(ErrorKind::option, fmt::format("{}.{} is {}, but must be between {} and {}.", section,
                                             name, value, min, max));
}

}  // namespace loopbit
