// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "loopbit/map_tools.hpp"

namespace loopbit {

/// The sessions of a map but those that are dropped. Throws Error (kind option) for one that the
/// map does not have.
std::vector<MapSession> sessions_but(const MapReader& map, const std::vector<int>& dropped);

/// compact_map() for a map on a server.
CompactCounts compact_on_server(const std::string& address, const CompactOptions& options);

}  // namespace loopbit
