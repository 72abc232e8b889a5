// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "loopbit/database.hpp"

namespace loopbit {

// A map's log, MAP-wal (sqlite.org/walformat.html), and the journal of a commit without a log,
// MAP-journal (sqlite.org/fileformat2.html, 3). SQLite accepts any of them beside a file as the
// file's own. So each log gets a mark, a random number in the header of the file. It is committed
// before the log begins, and each commit copies the header to the log. The header also says whether
// there is a log. A journal has the header before the commit, and each mark names the one before.

/// Empty, or what is wrong with the two version bytes of the header. SQLite may read such a file,
/// but not write it.
std::string header_fault(const Database& database);

/// Call this before anything is read. Throws Error (kind input) if the log or journal beside the
/// map is not its own, or if its own log is beside another name of the file.
void check_log(const Database& database);

/// Gives the map a new mark, for a log that is to begin.
void mark(const Database& database);

/// Begins the log of a map that has none.
void begin_log(const Database& database);

/// Writes the header as it is, which makes it the first page of a log or journal.
void write_header(const Database& database);

bool has_log(const Database& database);

/// Leaves one file without a log beside it. False if others have the map open: the log remains, and
/// is part of the map.
bool close_log(const Database& database);

/// Empty, or why the file may have another name, beside which its log would be missed.
std::string other_name(const std::string& path);

}  // namespace loopbit
