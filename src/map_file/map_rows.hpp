// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

#include "loopbit/error.hpp"
#include "loopbit/map_database.hpp"
#include "loopbit/map_file.hpp"

namespace loopbit {

// The rows of a map. Each has a checksum over its key and values. Readers leave out damaged rows,
// and add one clause per row or page to `damage`.

/// A list of damage without duplicates.
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

/// Which rows of a table are read, by their keys.
struct KeyRange {
  std::int64_t first = 1;
  std::int64_t last = std::numeric_limits<std::int64_t>::max() - 1;
};

/// Throws Error (kind input) if there are `clauses`: a damaged map is neither continued nor copied.
void refuse_damaged(const std::string& path, const std::vector<std::string>& clauses);

/// The Error (kind option) for a session that the map at `path` does not have.
Error unknown_session(const std::string& path, int session);

/// The keys of a session's places on a server.
KeyRange places_of(const MapDatabase& database, int session);

/// Of an older map, no session but the first is linked.
std::vector<MapSession> read_sessions(const MapDatabase& database, Damage& damage,
                                      const KeyRange& keys = {});

/// In order of id.
void for_each_place(const MapDatabase& database, const std::function<void(const MapPlace&)>& visit,
                    Damage& damage, const KeyRange& keys = {});

/// Calls visit(place, bytes) for each image, damaged or not, in order of place.
void for_each_image(const MapDatabase& database,
                    const std::function<void(std::int64_t, std::int64_t)>& visit, Damage& damage);

std::vector<MapLoop> read_loops(const MapDatabase& database, Damage& damage,
                                const KeyRange& keys = {});
std::vector<MapLoop> read_rejected_loops(const MapDatabase& database, Damage& damage,
                                         const KeyRange& keys = {});

/// In order of session and frame.
std::vector<MapOdometry> read_odometry(const MapDatabase& database, Damage& damage,
                                       const KeyRange& keys = {});

/// In the order in which they were measured.
std::vector<MapLoopPose> read_loop_poses(const MapDatabase& database, Damage& damage,
                                         const KeyRange& keys = {});

/// Commits to a map on a server: after the first, up to the last.
struct EpochRange {
  std::int64_t after = 0;
  std::int64_t last = std::numeric_limits<std::int64_t>::max();
};

/// Of the rows of these commits that are still there. In order of epoch and key.
void for_each_new_place(const MapDatabase& database, const EpochRange& epochs,
                        const std::function<void(const MapPlace&)>& visit, Damage& damage);

/// Of these commits.
std::unordered_set<std::int64_t> new_places(const MapDatabase& database, const EpochRange& epochs);

/// `table`: loop or rejected.
std::vector<MapLoop> read_new_loops(const MapDatabase& database, const std::string& table,
                                    const EpochRange& epochs, Damage& damage);

/// What a map has of a session, so that nothing is copied to it twice.
struct KnownRows {
  /// Frame of the session, session and frame of the match.
  using Pair = std::array<std::int64_t, 3>;

  std::int64_t frames = 0;
  std::set<Pair> loops = {};
  std::set<Pair> rejected = {};
  std::set<Pair> poses = {};  ///< loops whose relative pose is there

  static Pair pair(const SessionFrame& query, const SessionFrame& match) {
    return {query.frame, match.session, match.frame};
  }
};

/// By session. `session`: none = all.
std::map<int, KnownRows> known_rows(const MapDatabase& database,
                                    std::optional<int> session = std::nullopt);

/// The loop of `session` that a detection, one of a loop, is.
MapLoop loop_of(const Detection& detection, int session);
MapLoop loop_of(const LateLoop& loop, int session);

/// Reads features by place.
class FeatureReader {
 public:
  explicit FeatureReader(const MapDatabase& database);

  /// None, with a clause in `damage`, if they are missing, damaged or belong to another place.
  std::optional<Features> read(std::int64_t place, const SessionFrame& at, Damage& damage);

 private:
  std::unique_ptr<SqlStatement> row_;
};

/// Of the places with these keys, in no order. Leaves out what FeatureReader would.
void for_each_features(const MapDatabase& database, const KeyRange& keys,
                       const std::function<void(std::int64_t, Features)>& visit);

/// Reads images by place.
class ImageReader {
 public:
  explicit ImageReader(const MapDatabase& database);

  /// None if there is no image or, with a clause in `damage`, if it is damaged or belongs to
  /// another place.
  std::optional<std::vector<unsigned char>> read(std::int64_t place, const SessionFrame& at,
                                                 Damage& damage);

 private:
  std::unique_ptr<SqlStatement> row_;  ///< null if the map's version has no images
};

/// Writes rows in the current transaction. Throws Error (kind output).
class RowWriter {
 public:
  explicit RowWriter(const MapDatabase& database);

  /// Of an existing session, updates the number of frames. Does not write whether it is linked.
  void write(const MapSession& session);
  void write_linked(int session);
  void write(const MapPlace& place, const Features& features);
  /// Does nothing if there are no bytes.
  void write_image(const MapPlace& place, std::span<const unsigned char> jpeg);
  void write(const MapLoop& loop);
  void write_rejected(const MapLoop& loop);
  /// Its pose has a covariance.
  void write(const MapOdometry& odometry);
  void write(const MapLoopPose& pose);

 private:
  std::unique_ptr<SqlStatement> session_;
  std::unique_ptr<SqlStatement> linked_;
  std::unique_ptr<SqlStatement> place_;
  std::unique_ptr<SqlStatement> features_;
  std::unique_ptr<SqlStatement> image_;
  std::unique_ptr<SqlStatement> loop_;
  std::unique_ptr<SqlStatement> rejected_;
  std::unique_ptr<SqlStatement> odometry_;
  std::unique_ptr<SqlStatement> relative_pose_;
};

// Changes of rows in the current transaction. They throw Error (kind output).

/// Removes a place with its features and image.
void remove_place(const MapDatabase& database, std::int64_t place);

/// Moves the loop to those that are rejected. If there is no such loop, the pair is recorded all
/// the same. Linear in the loops of the map.
void reject_loop(const MapDatabase& database, const SessionFrame& query, const SessionFrame& match);
/// The same, with what is known of a loop that the map does not have.
void reject_loop(const MapDatabase& database, MapLoop loop);

}  // namespace loopbit
