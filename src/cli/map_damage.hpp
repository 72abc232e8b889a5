// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "loopbit/map_file.hpp"

namespace loopbit::cli {

/// Warns on stderr if damaged rows were left out so far.
void warn_of_damage(const MapReader& map);

/// The same for a map that was also written.
void warn_of_damage(const std::string& path, const std::vector<std::string>& damage);

}  // namespace loopbit::cli
