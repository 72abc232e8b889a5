// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "map_schema.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

struct Table {
  const char* name;
  const char* definition;  ///< as SQLite keeps it
  int since = 1;           ///< the version of maps that brought it
};

constexpr std::array kTables{
    Table{"session",
          "CREATE TABLE session (session INTEGER PRIMARY KEY AUTOINCREMENT, uid TEXT NOT NULL, "
          "name TEXT NOT NULL, started TEXT NOT NULL, loopbit TEXT NOT NULL, options TEXT NOT "
          "NULL, frames INTEGER NOT NULL, checksum INTEGER NOT NULL)"},
    Table{"place",
          "CREATE TABLE place (place INTEGER PRIMARY KEY AUTOINCREMENT, session INTEGER NOT NULL, "
          "frame INTEGER NOT NULL, timestamp REAL, content BLOB NOT NULL, checksum INTEGER NOT "
          "NULL)"},
    Table{"features",
          "CREATE TABLE features (place INTEGER PRIMARY KEY, features BLOB NOT NULL, checksum "
          "INTEGER NOT NULL)"},
    Table{"loop",
          "CREATE TABLE loop (loop INTEGER PRIMARY KEY, session INTEGER NOT NULL, frame INTEGER "
          "NOT NULL, match_session INTEGER NOT NULL, match_frame INTEGER NOT NULL, score REAL NOT "
          "NULL, similarity REAL NOT NULL, matches INTEGER NOT NULL, inliers INTEGER NOT NULL, "
          "checksum INTEGER NOT NULL)"},
    Table{"image",
          "CREATE TABLE image (place INTEGER PRIMARY KEY, image BLOB NOT NULL, checksum INTEGER "
          "NOT NULL)",
          kFirstVersionWithImages}};

/// SQLite makes it for AUTOINCREMENT.
constexpr Table kSequences{"sqlite_sequence", "CREATE TABLE sqlite_sequence(name,seq)"};

Database::Remedies remedies(const std::string& path) {
  return {.write =
              "check the free space and the permissions of its folder, then run again with the "
              "same map: what was saved before is kept",
          .read = fmt::format("it is no map of loopbit's, or damaged; 'loopbit map check {} "
                              "--recover NEW.db' saves what is left of a damaged one",
                              path)};
}

/// Throws Error (kind input) if there is no file, or the system does not say.
void check_is_file(const std::string& path) {
  std::error_code error;
  const auto type = std::filesystem::status(path, error).type();
  if (type == std::filesystem::file_type::regular) return;
  if (type == std::filesystem::file_type::none) {
    throw Error(ErrorKind::input, fmt::format("'{}' cannot be read ({}): check the path and the "
                                              "permissions of its folder.",
                                              path, error.message()));
  }
  throw Error(
      ErrorKind::input,
      fmt::format("There is no map '{}'; 'loopbit run INPUT --map {}' makes one.", path, path));
}

[[noreturn]] void refuse(const Database& database, const std::string& why) {
  throw Error(ErrorKind::input, fmt::format("'{}' {}.", database.path(), why));
}

/// A map has the tables of its version and no others: no view or trigger of a stranger is run.
void check_tables(const Database& database, int version) {
  Statement rows(database, "SELECT name, sql FROM sqlite_schema");
  std::ptrdiff_t known = 0;
  while (rows.step()) {
    const std::string name = rows.text(0);
    const std::string sql = rows.text(1);
    const auto is_this = [&](const Table& table) {
      return table.since <= version && name == table.name && sql == table.definition;
    };
    if (!is_this(kSequences) && std::none_of(kTables.begin(), kTables.end(), is_this)) {
      refuse(database, fmt::format("has a table '{}' that no map of version {} has: it was changed "
                                   "by something else; use a copy from before",
                                   name, version));
    }
    ++known;
  }
  const auto expected = std::count_if(kTables.begin(), kTables.end(),
                                      [&](const Table& table) { return table.since <= version; });
  if (known != expected + 1) refuse(database, "lacks tables of a map: use a copy from before");
}

/// The version of the map; 0 for an empty file.
int checked_version(const Database& database) {
  const auto id = database.integer("PRAGMA application_id");
  const auto version = database.integer("PRAGMA user_version");
  if (id == 0 && version == 0 && database.integer("SELECT count(*) FROM sqlite_schema") == 0) {
    return 0;
  }
  if (id != kMapApplicationId) {
    refuse(database, "is a SQLite file, but no map of loopbit's; name another file");
  }
  if (version > kMapVersion || version < 1) {
    refuse(database, fmt::format("is a map of version {}, but this loopbit knows versions up to "
                                 "{}; use a newer loopbit",
                                 version, kMapVersion));
  }
  return static_cast<int>(version);
}

/// Versions so far add tables; an empty file has version 0.
void migrate(const Database& database, int from, int to) {
  if (from >= to) return;
  database.execute("BEGIN IMMEDIATE");
  for (const Table& table : kTables) {
    if (table.since > from && table.since <= to) database.execute(table.definition);
  }
  database.execute(fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}; COMMIT",
                               kMapApplicationId, to));
}

}  // namespace

bool has_images(const Database& database) {
  return database.integer("PRAGMA user_version") >= kFirstVersionWithImages;
}

Database open_map_for_writing(const std::string& path, int version) {
  Database database(path, Database::Access::create, remedies(path));
  database.execute(fmt::format("PRAGMA page_size = {}", kMapPageBytes));
  const int found = checked_version(database);
  if (found > 0) check_tables(database, found);
  migrate(database, found, version);
  // Each commit is on disk when it returns (sqlite.org/wal.html, "Performance Considerations").
  database.execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL");
  return database;
}

bool close_log(const Database& database) {
  try {
    database.execute("PRAGMA busy_timeout = 0");
    Statement mode(database, "PRAGMA journal_mode = DELETE");
    if (mode.step() && mode.text(0) == "delete") return true;
  } catch (const Error&) {  // it is locked
  }
  try {
    // The log stays, but a copy of the file alone has all that no reader is in the midst of.
    database.execute("PRAGMA wal_checkpoint(FULL)");
  } catch (const Error&) {
  }
  return false;
}

Database open_map_for_reading(const std::string& path) {
  check_is_file(path);
  Database database(path, Database::Access::read, remedies(path));
  const int version = checked_version(database);
  if (version == 0) refuse(database, "is empty; 'loopbit run INPUT --map' fills it");
  check_tables(database, version);
  return database;
}

bool is_newer_map(const std::string& path) {
  check_is_file(path);
  const Database database(path, Database::Access::read, remedies(path));
  Statement id(database, "PRAGMA application_id");
  return id.step_if_readable() == Statement::Step::row && id.integer(0) == kMapApplicationId &&
         database.integer("PRAGMA user_version") > kMapVersion;
}

}  // namespace loopbit
