// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "loopbit/map_database.hpp"

namespace loopbit {

/// Opens maps on database servers. The library fleet_map has one for PostgreSQL.
class MapServer {
 public:
  MapServer() = default;
  virtual ~MapServer() = default;
  MapServer(const MapServer&) = delete;
  MapServer& operator=(const MapServer&) = delete;
  MapServer(MapServer&&) = delete;
  MapServer& operator=(MapServer&&) = delete;

  /// The address without its secrets; of an address that is not valid, only the beginning. Never
  /// throws Error.
  [[nodiscard]] virtual std::string shown(const std::string& address) const = 0;

  /// The name of the database.
  [[nodiscard]] virtual std::string name(const std::string& address) const = 0;

  /// Throws Error: kind input if the map cannot be reached or read, output if it cannot be written.
  [[nodiscard]] virtual std::unique_ptr<MapDatabase> open(const std::string& address,
                                                          MapDatabase::Access access) const = 0;

  /// Makes the tables of an empty map, whose sessions get numbers from `first_session` on, and the
  /// roles that read and write it. False, and nothing is changed, if they are there. Throws Error
  /// (kind output).
  [[nodiscard]] virtual bool create(const std::string& address, int first_session) const = 0;
};

/// Makes maps on servers usable, by their addresses, wherever a map's path is expected. Call it
/// before they are used.
void set_map_server(std::unique_ptr<const MapServer> server);

/// Whether it is the address of a map on a server, such as "postgresql://host/database".
[[nodiscard]] bool is_map_address(const std::string& path);

/// Makes an empty map on a server; see MapServer::create(). Throws Error (kind option) if `address`
/// is none.
[[nodiscard]] bool create_map(const std::string& address, int first_session = 1);

/// The addresses of maps on several servers, separated by spaces; else `path` itself.
[[nodiscard]] std::vector<std::string> addresses_in(const std::string& path);

/// The database of a map on a server, or on the first of several; the path of a file without its
/// extension.
[[nodiscard]] std::string map_stem(const std::string& path);

/// A path, an argument or a line of text with no secret of a map's address in it.
[[nodiscard]] std::string without_secrets(const std::string& text);

}  // namespace loopbit
