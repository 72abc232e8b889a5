// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

#include "loopbit/database.hpp"
#include "loopbit/map_file.hpp"

namespace loopbit {

// The rows of a map, each with a checksum over its key and values, so that no damage passes for
// data. Readers leave out what is damaged, and say so in `damage`, a clause a row or page.

/// What was found damaged, each thing once.
class Damage {
 public:
  void add(const std::string& clause) {
    if (known_.insert(clause).second) clauses_.push_back(clause);
  }

  [[nodiscard]] const std::vector<std::string>& clauses() const { return clauses_; }

 private:
  std::vector<std::string> clauses_;
  std::unordered_set<std::string> known_;
};

/// Throws Error (kind input) if there are `clauses`: no map is written to or copied from while
/// damaged.
void refuse_damaged(const std::string& path, const std::vector<std::string>& clauses);

std::vector<MapSession> read_sessions(const Database& database, Damage& damage);

/// In order of id.
void for_each_place(const Database& database, const std::function<void(const MapPlace&)>& visit,
                    Damage& damage);

/// Calls visit(place, bytes) for each image that is listed, whether or not it is whole, in order of
/// place.
void for_each_image(const Database& database,
                    const std::function<void(std::int64_t, std::int64_t)>& visit, Damage& damage);

std::vector<MapLoop> read_loops(const Database& database, Damage& damage);

/// Reads features by place.
class FeatureReader {
 public:
  explicit FeatureReader(const Database& database);

  /// None, with a clause in `damage`, if they are missing, damaged or another place's.
  std::optional<Features> read(std::int64_t place, const SessionFrame& at, Damage& damage);

 private:
  Statement row_;
};

/// Reads images by place.
class ImageReader {
 public:
  explicit ImageReader(const Database& database);

  /// None if none was kept, or, with a clause in `damage`, if it is damaged or another place's.
  std::optional<std::vector<unsigned char>> read(std::int64_t place, const SessionFrame& at,
                                                 Damage& damage);

 private:
  std::optional<Statement> row_;  ///< none in a map of a version without images
};

/// Writes rows within whatever transaction there is. Throws Error (kind output).
class RowWriter {
 public:
  explicit RowWriter(const Database& database);

  /// A session that is there is given the new number of frames.
  void write(const MapSession& session);
  void write(const MapPlace& place, const Features& features);
  /// Nothing if there are no bytes.
  void write_image(const MapPlace& place, std::span<const unsigned char> jpeg);
  void write(const MapLoop& loop);

 private:
  Statement session_;
  Statement place_;
  Statement features_;
  Statement image_;
  Statement loop_;
};

/// The next free keys.
int next_session(const Database& database);
std::int64_t next_place(const Database& database);

}  // namespace loopbit
