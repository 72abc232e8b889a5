// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "loopbit/database.hpp"

namespace loopbit {

/// "loop" in ASCII: what file(1) and SQLite tell a map by.
inline constexpr int kMapApplicationId = 0x6c6f6f70;

/// The version of the format that this library writes. It reads all before, too.
inline constexpr int kMapVersion = 2;
inline constexpr int kFirstVersionWithImages = 2;

/// Large pages: features take 48 KB a place, contents are read one after the other.
inline constexpr int kMapPageBytes = 16384;

/// Opens a map to be written, made if there is none or an empty file: with the right to write it,
/// which the database keeps, and without writing to it, but for what a killed run left in its log.
/// Throws Error (kind input) if the file is no map, of a newer version or damaged where its tables
/// are listed, (kind output) if it has a writer or cannot be written. `version`: of a map that is
/// made, to repair an older one by.
Database open_map_for_writing(const std::string& path, int version = kMapVersion);

/// A transaction of a map that is open for writing, which it brings to kMapVersion. Unless it ends,
/// it changes nothing. The first one of a map without a log goes to the file itself, where damage
/// that it meets leaves no trace; the log begins when it ends.
class Commit {
 public:
  explicit Commit(const Database& database);
  ~Commit();
  Commit(const Commit&) = delete;
  Commit& operator=(const Commit&) = delete;
  Commit(Commit&&) = delete;
  Commit& operator=(Commit&&) = delete;

  /// What is committed survives the loss of power, and is seen by readers.
  void end();

 private:
  Commit(const Database& database, bool is_logged);

  const Database& database_;
  bool is_logged_;
  bool has_ended_ = false;
};

/// Whether this process or another has the map open to be written. Throws Error (kind input) if
/// there is none.
bool is_being_written(const std::string& path);

/// Whether the map's version has a table of images.
bool has_images(const Database& database);

/// Opens a map to be read, beside a writer or without. Throws Error (kind input) as above.
Database open_map_for_reading(const std::string& path);

/// Whether the map is of a newer version; not if its first page is damaged. Throws Error (kind
/// input) if there is no file, it may not be read, another program holds it or its log is not its
/// own.
bool is_newer_map(const std::string& path);

}  // namespace loopbit
