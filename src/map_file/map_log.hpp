// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "loopbit/database.hpp"

namespace loopbit {

// A map's log, MAP-wal (sqlite.org/walformat.html). SQLite takes any log that lies beside a file
// for the file's own. So each log gets a mark, a random number in the header of the file: it is
// drawn before the log begins, and each commit copies the header to the log. The header also says
// whether there is a log at all.

/// Empty, or what is wrong with the two bytes of the header that say how the file is written:
/// SQLite reads it all the same.
std::string header_fault(const Database& database);

/// To be called before anything is read. Throws Error (kind input) if the log that lies beside the
/// map is not its own, or if its own lies beside another name of the file.
void check_log(const Database& database);

/// Begins the log of a map that has none. Its first page says so from then on.
void begin_log(const Database& database);

/// Whether the map has a log.
bool has_log(const Database& database);

/// Leaves one file without a log beside it. False if others have the map open: the log remains, and
/// is part of the map.
bool close_log(const Database& database);

/// Empty, or why the file must not be written under its name: its log could be missed.
std::string other_name(const std::string& path);

}  // namespace loopbit
