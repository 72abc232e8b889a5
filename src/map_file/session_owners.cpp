// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "session_owners.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {

std::map<int, std::size_t> owners_of(const std::vector<ServerSessions>& servers) {
  std::map<int, std::size_t> owners;
  std::map<int, const MapSession*> found;
  for (std::size_t number = 0; number < servers.size(); ++number) {
    for (const MapSession& session : servers[number].sessions) {
      const auto [earlier, is_new] = found.emplace(session.session, &session);
      if (!is_new && earlier->second->uid != session.uid) {
        throw Error(
            ErrorKind::option,
            fmt::format("Session {} in '{}' is another one than in '{}': number the sessions of "
                        "maps differently, by 'loopbit map create --first-session'.",
                        session.session, servers[owners.at(session.session)].server,
                        servers[number].server));
      }
      if (!is_new && earlier->second->frames >= session.frames) continue;
      earlier->second = &session;
      owners[session.session] = number;
    }
  }
  return owners;
}

std::set<int> numbers_of(const std::vector<ServerSessions>& servers) {
  std::set<int> numbers;
  for (const ServerSessions& server : servers) {
    for (const MapSession& session : server.sessions) numbers.insert(session.session);
  }
  return numbers;
}

/// The first snapshots may lack a session that reaches one server after its snapshot and leaves
/// another one before. Then that one had it before.
void take_snapshots(std::set<int> before, const std::function<std::set<int>()>& take) {
  std::set<int> now = take();
  while (!std::ranges::includes(now, before)) {
    before = std::exchange(now, {});
    now = take();
  }
}

}  // namespace loopbit
