// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "map_damage.hpp"

#include <fmt/format.h>

#include "streams.hpp"

namespace loopbit::cli {

void warn_of_damage(const MapReader& map) { warn_of_damage(map.path(), map.damage()); }

void warn_of_damage(const std::string& path, const std::vector<std::string>& damage) {
  if (damage.empty()) return;
  tell(
      fmt::format("loopbit: '{0}' is damaged, and what is damaged was left out ({1}; {2} in all); "
                  "'loopbit map check {0}' lists it.\n",
                  path, damage.front(), damage.size()));
}

}  // namespace loopbit::cli
