// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "loopbit/map_file.hpp"

namespace loopbit::cli {

/// Says on stderr that what was read so far is not all there was, if so.
void warn_of_damage(const MapReader& map);

/// The same of a map that was written, too.
void warn_of_damage(const std::string& path, const std::vector<std::string>& damage);

}  // namespace loopbit::cli
