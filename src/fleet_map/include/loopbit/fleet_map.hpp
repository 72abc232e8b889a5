// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

namespace loopbit {

/// From now on, "postgresql://..." is a map on a PostgreSQL server wherever a map's path is
/// expected. docs/format.md describes its tables, docs/fleet.md its roles.
void use_fleet_maps();

}  // namespace loopbit
