// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "map_schema.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "loopbit/error.hpp"
#include "loopbit/write_file.hpp"

#include "map_log.hpp"
#include "map_rows.hpp"

namespace loopbit {
namespace {

struct Table {
  const char* name;
  const char* definition;  ///< as SQLite keeps it
  int since = 1;           ///< the first version of maps that has it
};

constexpr std::array kMapTables{
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
          kFirstVersionWithImages},
    Table{"linked", "CREATE TABLE linked (session INTEGER PRIMARY KEY, checksum INTEGER NOT NULL)",
          kFirstVersionWithLinks},
    Table{"rejected",
          "CREATE TABLE rejected (rejected INTEGER PRIMARY KEY, session INTEGER NOT NULL, frame "
          "INTEGER NOT NULL, match_session INTEGER NOT NULL, match_frame INTEGER NOT NULL, score "
          "REAL NOT NULL, similarity REAL NOT NULL, matches INTEGER NOT NULL, inliers INTEGER NOT "
          "NULL, checksum INTEGER NOT NULL)",
          kFirstVersionWithLinks},
    Table{"odometry",
          "CREATE TABLE odometry (odometry INTEGER PRIMARY KEY, session INTEGER NOT NULL, frame "
          "INTEGER NOT NULL, timestamp REAL, pose BLOB NOT NULL, checksum INTEGER NOT NULL)",
          kFirstVersionWithOdometry},
    Table{"relative_pose",
          "CREATE TABLE relative_pose (relative_pose INTEGER PRIMARY KEY, session INTEGER NOT "
          "NULL, frame INTEGER NOT NULL, match_session INTEGER NOT NULL, match_frame INTEGER NOT "
          "NULL, known TEXT NOT NULL, pose BLOB NOT NULL, checksum INTEGER NOT NULL)",
          kFirstVersionWithOdometry}};

/// SQLite creates it for AUTOINCREMENT.
constexpr Table kSequences{"sqlite_sequence", "CREATE TABLE sqlite_sequence(name,seq)"};

Database::Remedies remedies(const std::string& path) {
  return {.write =
              "check the free space and the permissions of its folder, then run again with the "
              "same map: what was saved before is kept",
          .read = fmt::format("it is no map of loopbit's, or damaged; 'loopbit map check {} "
                              "--recover NEW.db' saves what is left of a damaged one",
                              path)};
}

/// Throws Error (kind input) unless `path` is a file.
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

/// A map has exactly the tables of its version, so no foreign view or trigger is ever run.
void check_tables(const Database& database, int version) {
  Statement rows(database, "SELECT name, sql FROM sqlite_schema");
  std::ptrdiff_t known = 0;
  while (rows.step()) {
    const std::string name = rows.text(0);
    const std::string sql = rows.text(1);
    const auto is_this = [&](const Table& table) {
      return table.since <= version && name == table.name && sql == table.definition;
    };
    // SQLite fills up a page that was cut in two with zeros.
    if (name.empty())
      refuse(database, "is damaged where it lists its tables; use a copy from before");
    if (!is_this(kSequences) && std::none_of(kMapTables.begin(), kMapTables.end(), is_this)) {
      refuse(database, fmt::format("has a table '{}' that no map of version {} has: it was changed "
                                   "by something else; use a copy from before",
                                   name, version));
    }
    ++known;
  }
  const auto expected = std::count_if(kMapTables.begin(), kMapTables.end(),
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

/// Each version so far adds tables. An empty file has version 0.
void migrate(const Database& database, int from, int to) {
  if (from >= to) return;
  for (const Table& table : kMapTables) {
    if (table.since > from && table.since <= to) database.execute(table.definition);
  }
  database.execute(
      fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}", kMapApplicationId, to));
}

/// Opens or creates a file and locks it for writing.
Database lock_map(const std::string& path) {
  while (true) {
    Database database(path, Database::Access::create, remedies(path));
    const bool is_locked = database.file().lock();
    if (!database.file().is_at_its_path()) continue;  // it was compacted just now
    if (is_locked) return database;
    throw Error(ErrorKind::output,
                fmt::format("'{}' is being written by another run; wait until that ends, or name "
                            "another map. Reading it is possible all the time.",
                            path));
  }
}

/// Throws Error (kind output) if a log would be overlooked or cannot be created.
void check_may_be_written(const std::string& path) {
  if (const std::string reason = other_name(path); !reason.empty()) {
    throw Error(ErrorKind::output,
                fmt::format("'{}' {}, and the log of a run would be beside one name only. Copy the "
                            "map to a file of its own, or mount its folder, and use that.",
                            path, reason));
  }
  const auto folder = std::filesystem::path(resolved_path(path)).parent_path();
  if (faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) != 0) {
    throw cannot_write(path, errno);
  }
}

}  // namespace

bool has_images(const MapDatabase& database) {
  return database.version() >= kFirstVersionWithImages;
}

bool has_links(const MapDatabase& database) { return database.version() >= kFirstVersionWithLinks; }

bool has_odometry(const MapDatabase& database) {
  return database.version() >= kFirstVersionWithOdometry;
}

Database open_map_for_writing(const std::string& path, int version) {
  Database database = lock_map(path);
  if (const std::string fault = header_fault(database); !fault.empty()) {
    refuse_damaged(path, {fault});
  }
  check_may_be_written(path);
  check_log(database);
  // Each commit is on disk when it returns (sqlite.org/wal.html, "Performance Considerations").
  // With EXTRA that also holds for the first commit, before the log begins.
  database.execute(fmt::format("PRAGMA page_size = {}; PRAGMA synchronous = EXTRA", kMapPageBytes));
  const int found = checked_version(database);
  if (found > 0) check_tables(database, found);
  close_log(database);  // of a run that was killed
  // Throws if nothing can be written, or if a long read would prevent the log.
  database.execute("BEGIN EXCLUSIVE; ROLLBACK");
  if (found == 0) {
    database.execute("BEGIN IMMEDIATE");
    migrate(database, found, version);
    database.execute("COMMIT");
  }
  return database;
}

Commit::Commit(const Database& database) : Commit(database, has_log(database)) {
  write_header(database);
  migrate(database, static_cast<int>(database.integer("PRAGMA user_version")), kMapVersion);
  if (!is_logged_) mark(database);
}

Commit::Commit(const Database& database, bool is_logged)
    : database_(database), is_logged_(is_logged) {
  database.execute("BEGIN IMMEDIATE");
}

Commit::~Commit() {
  if (has_ended_) return;
  try {
    database_.execute("ROLLBACK");
  } catch (const Error&) {  // SQLite has left it already
  }
}

void Commit::end() {
  database_.execute("COMMIT");
  has_ended_ = true;
  if (!is_logged_) begin_log(database_);
}

bool is_being_written(const std::string& path) { return OpenFile(path).is_locked(); }

Database open_map_for_reading(const std::string& path) {
  check_is_file(path);
  Database database(path, Database::Access::read, remedies(path));
  check_log(database);
  const int version = checked_version(database);
  if (version == 0) refuse(database, "is empty; 'loopbit run INPUT --map' fills it");
  check_tables(database, version);
  return database;
}

bool is_newer_map(const std::string& path) {
  check_is_file(path);
  const Database database(path, Database::Access::read, remedies(path));
  check_log(database);
  Statement id(database, "PRAGMA application_id");
  return id.step_if_readable() == Statement::Step::row && id.integer(0) == kMapApplicationId &&
         database.integer("PRAGMA user_version") > kMapVersion;
}

}  // namespace loopbit
