// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/fleet_map.hpp"

#include <memory>
#include <string>

#include "loopbit/error.hpp"
#include "loopbit/map_server.hpp"

#include "address.hpp"
#include "connection.hpp"
#include "fleet_database.hpp"
#include "fleet_schema.hpp"

namespace loopbit {
namespace {

class Postgres final : public MapServer {
 public:
  [[nodiscard]] std::string shown(const std::string& address) const override {
    try {
      return Address(address).shown();
    } catch (const Error&) {
      return "postgresql://...";
    }
  }

  [[nodiscard]] std::string name(const std::string& address) const override {
    return Address(address).name();
  }

  [[nodiscard]] std::unique_ptr<MapDatabase> open(const std::string& address,
                                                  MapDatabase::Access access) const override {
    return std::make_unique<FleetDatabase>(Address(address), access);
  }

  [[nodiscard]] bool create(const std::string& address, int first_session) const override {
    const Connection connection(Address(address), MapDatabase::Access::write);
    connection.execute("BEGIN; SELECT pg_advisory_xact_lock(1819242352, -1)");
    if (has_tables(connection)) {
      check_version(connection);
      return false;
    }
    create_tables(connection, first_session);
    connection.execute("COMMIT");
    return true;
  }
};

}  // namespace

void use_fleet_maps() { set_map_server(std::make_unique<Postgres>()); }

}  // namespace loopbit
