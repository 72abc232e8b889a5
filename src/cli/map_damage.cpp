// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "map_damage.hpp"

#include <cstdio>

#include <fmt/format.h>

namespace loopbit::cli {

void warn_of_damage(const MapReader& map) {
  if (map.damage().empty()) return;
  fmt::print(stderr,
             "loopbit: '{0}' is damaged, and what is damaged was left out ({1}; {2} in all); "
             "'loopbit map check {0}' lists it.\n",
             map.path(), map.damage().front(), map.damage().size());
}

}  // namespace loopbit::cli
