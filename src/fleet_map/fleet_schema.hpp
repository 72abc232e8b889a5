// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "connection.hpp"

namespace loopbit {

/// The version of the tables on a server. All are those of map files of version 4.
inline constexpr int kFleetVersion = 3;

/// Makes the tables and roles in the current transaction. `first_session`: its number.
void create_tables(const Connection& connection, int first_session);

/// Whether the database has tables of a map, of whatever version.
bool has_tables(const Connection& connection);

/// Throws Error (kind input) if there are none, or if they are of another version.
void check_version(const Connection& connection);

}  // namespace loopbit
