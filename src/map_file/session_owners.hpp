// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "loopbit/map_file.hpp"

namespace loopbit {

// Several servers that have the sessions of a map together. While a session is being moved, two of
// them have it.

/// What one of them has.
struct ServerSessions {
  std::string server;  ///< its address, for messages
  std::vector<MapSession> sessions;
};

/// The server whose copy of a session counts, by session: the first one of those with the most
/// frames. Throws Error (kind option) if two have different sessions of the same number.
std::map<int, std::size_t> owners_of(const std::vector<ServerSessions>& servers);

/// Calls `take`, which begins a snapshot of each and returns the numbers of their sessions, until
/// the snapshots together have all sessions. `before`: the sessions that were there earlier.
void take_snapshots(std::set<int> before, const std::function<std::set<int>()>& take);

/// Their numbers.
std::set<int> numbers_of(const std::vector<ServerSessions>& servers);

}  // namespace loopbit
