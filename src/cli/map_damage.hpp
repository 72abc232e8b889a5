// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "loopbit/map_file.hpp"

namespace loopbit::cli {

/// Says on stderr that what was read so far is not all there was, if so.
void warn_of_damage(const MapReader& map);

}  // namespace loopbit::cli
