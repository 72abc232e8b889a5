// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "loopbit/database.hpp"
#include "loopbit/map_database.hpp"

namespace loopbit {

/// "loop" in ASCII, by which file(1) and SQLite recognise a map.
inline constexpr int kMapApplicationId = 0x6c6f6f70;

/// The version of the format that this library writes. It also reads all earlier ones.
inline constexpr int kMapVersion = 4;
inline constexpr int kFirstVersionWithImages = 2;
inline constexpr int kFirstVersionWithLinks = 3;
inline constexpr int kFirstVersionWithOdometry = 4;

/// Pages are large because features take 48 KB per place and contents are read in sequence.
inline constexpr int kMapPageBytes = 16384;

/// Opens a map for writing, and creates it if the file is missing or empty. The database holds the
/// lock of the map. An existing map is not changed, except that the log of a killed run is taken
/// into it. `version`: of a new map, to repair an older one. Throws Error: kind input if the file
/// is no map, has a newer version or a damaged list of tables; output if it has a writer or cannot
/// be written.
Database open_map_for_writing(const std::string& path, int version = kMapVersion);

/// A transaction, which also upgrades the map to kMapVersion. It is rolled back unless end() is
/// called. If the map has no log, the transaction goes to the file itself, and the log begins when
/// it ends. So a transaction that fails because of damage changes no byte of the file.
class Commit {
 public:
  explicit Commit(const Database& database);
  ~Commit();
  Commit(const Commit&) = delete;
  Commit& operator=(const Commit&) = delete;
  Commit(Commit&&) = delete;
  Commit& operator=(Commit&&) = delete;

  /// Commits. The rows are on disk when this returns.
  void end();

 private:
  Commit(const Database& database, bool is_logged);

  const Database& database_;
  bool is_logged_;
  bool has_ended_ = false;
};

/// Whether this process or another has the map open for writing. Throws Error (kind input) if there
/// is no file.
bool is_being_written(const std::string& path);

/// Whether the map's version has images.
bool has_images(const MapDatabase& database);

/// Whether the map's version has the tables `linked` and `rejected`.
bool has_links(const MapDatabase& database);

/// Whether the map's version has the tables `odometry` and `relative_pose`.
bool has_odometry(const MapDatabase& database);

/// Opens a map for reading, also while it is written. Throws Error (kind input) as above.
Database open_map_for_reading(const std::string& path);

/// Whether the map has a newer version; false if its first page is damaged. Throws Error (kind
/// input) if the file is missing, unreadable or locked, or has the log of another map beside it.
bool is_newer_map(const std::string& path);

}  // namespace loopbit
