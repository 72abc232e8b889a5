// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The tools that remove rows from maps on servers: moving sessions to another server, and
// compacting.
#include "server_tools.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/map_server.hpp"

#include "file_database.hpp"
#include "map_options.hpp"
#include "map_rows.hpp"
#include "thinning.hpp"

namespace loopbit {
namespace {

/// A row of a session: the number of its table, what tells it from others there, and its checksum.
using SessionRow = std::array<std::int64_t, 5>;

constexpr const char* kSessionRows =
    "SELECT 0, frames, 0, 0, checksum FROM session WHERE session = ?1 "
    "UNION ALL SELECT 1, place, 0, 0, checksum FROM place WHERE session = ?1 "
    "UNION ALL SELECT 2, place, 0, 0, checksum FROM features WHERE place BETWEEN ?2 AND ?3 "
    "UNION ALL SELECT 3, place, 0, 0, checksum FROM image WHERE place BETWEEN ?2 AND ?3 "
    "UNION ALL SELECT 4, frame, match_session, match_frame, checksum FROM loop WHERE session = ?1 "
    "UNION ALL SELECT 5, frame, match_session, match_frame, checksum FROM rejected WHERE session = "
    "?1 UNION ALL SELECT 6, frame, 0, 0, checksum FROM odometry WHERE session = ?1 "
    "UNION ALL SELECT 7, frame, match_session, match_frame, checksum FROM relative_pose WHERE "
    "session = ?1";

/// Sorted. A checksum covers its row, so that equal lists are equal sessions.
std::vector<SessionRow> session_rows(const MapDatabase& map, int session) {
  const auto found = map.prepare(kSessionRows);
  const KeyRange places = places_of(map, session);
  found->bind(1, std::int64_t{session});
  found->bind(2, places.first);
  found->bind(3, places.last);
  std::vector<SessionRow> rows;
  while (found->step()) {
    SessionRow& row = rows.emplace_back();
    for (std::size_t i = 0; i < row.size(); ++i) row.at(i) = found->integer(static_cast<int>(i));
  }
  std::ranges::sort(rows);
  return rows;
}

/// Reads every byte of a session, and writes it to `to` unless that is null.
void read_session_rows(const MapDatabase& from, int session, RowWriter* to, Damage& damage) {
  FeatureReader features(from);
  ImageReader images(from);
  for_each_place(
      from,
      [&](const MapPlace& place) {
        const auto read = features.read(place.id, place.at, damage);
        const auto image = images.read(place.id, place.at, damage);
        if (!to || !read) return;
        to->write(place, *read);
        if (image) to->write_image(place, *image);
      },
      damage, places_of(from, session));
  const auto each = [&](const auto& rows, const auto& at, const auto& write) {
    for (const auto& row : rows) {
      if (to && at(row).session == session) write(row);
    }
  };
  const auto query = [](const auto& row) { return row.query; };
  each(read_loops(from, damage), query, [&](const MapLoop& loop) { to->write(loop); });
  each(read_rejected_loops(from, damage), query,
       [&](const MapLoop& loop) { to->write_rejected(loop); });
  each(
      read_odometry(from, damage), [](const MapOdometry& row) { return row.at; },
      [&](const MapOdometry& row) { to->write(row); });
  each(read_loop_poses(from, damage), query, [&](const MapLoopPose& pose) { to->write(pose); });
}

// In the current transaction. Features and images go with their places.

void remove_rows(const MapDatabase& map, const char* table, const char* column, std::int64_t key) {
  const auto rows = map.prepare(fmt::format("DELETE FROM {} WHERE {} = ?1", table, column));
  rows->bind(1, key);
  rows->run();
}

/// But for loops of other sessions that lead to it.
void remove_session(const MapDatabase& map, int session) {
  for (const char* table :
       {"linked", "relative_pose", "odometry", "rejected", "loop", "place", "session"}) {
    remove_rows(map, table, "session", session);
  }
}

/// Rows that row-level security hides from a user would be left behind.
void check_owns(const MapDatabase& map) {
  const auto hides = map.prepare("SELECT row_security_active('session')");
  if (hides->step() && hides->integer(0) == 0) return;
  throw Error(ErrorKind::output,
              fmt::format("'{}' lets only its owner remove rows, the role that made the map by "
                          "'loopbit map create'; name that role in the address.",
                          map.path()));
}

class SessionMove {
 public:
  SessionMove(const std::string& from, const std::string& to)
      : source_(open_map(from, MapDatabase::Access::write)),
        reader_(open_map(from, MapDatabase::Access::read)),
        target_(open_map(to, MapDatabase::Access::write)) {
    check_owns(*source_);
    check_owns(*target_);
  }

  void move(int session, MoveCounts& counts) {
    hold(session);
    const Sessions here = sessions_in(*source_);
    const Sessions there = sessions_in(*target_);
    const MapSession* const moved = find(here, session);
    if (!moved) {
      if (!find(there, session)) throw unknown_session(source_->path(), session);
      ++counts.known;
      return;
    }
    check(*moved, there);
    const std::vector<SessionRow> rows = session_rows(*source_, session);
    if (session_rows(*target_, session) != rows || !damage_there(session).clauses().empty()) {
      copy(*moved, there);
      refuse_damaged(target_->path(), damage_there(session).clauses());
      if (session_rows(*target_, session) != rows) throw changed(session);
    }
    remove(*moved, rows);
    ++counts.sessions;
    counts.places += std::ranges::count(rows, 1, [](const SessionRow& row) { return row.front(); });
  }

 private:
  using Sessions = std::vector<MapSession>;

  static Sessions sessions_in(const MapDatabase& map) {
    Damage damage;
    Sessions sessions = read_sessions(map, damage);
    refuse_damaged(map.path(), damage.clauses());
    return sessions;
  }

  static const MapSession* find(const Sessions& sessions, int session) {
    const auto found = std::ranges::find(sessions, session, &MapSession::session);
    return found == sessions.end() ? nullptr : &*found;
  }

  /// Both databases keep it from its robot, so they are not the same one.
  void hold(int session) const {
    if (!source_->hold_session(session)) {
      throw Error(ErrorKind::output, fmt::format("Session {} of '{}' is being written; move it "
                                                 "when its run has ended.",
                                                 session, source_->path()));
    }
    if (!target_->hold_session(session)) {
      throw Error(
          ErrorKind::output,
          fmt::format("Session {} of '{}' is being written, or that is the map '{}' itself; "
                      "give the address of another map, or wait until the run has ended.",
                      session, target_->path(), source_->path()));
    }
  }

  [[nodiscard]] Error changed(int session) const {
    return {ErrorKind::output,
            fmt::format("Session {} of '{}' was changed while it was copied, and "
                        "is still there; run the same command again.",
                        session, source_->path())};
  }

  /// Throws Error (kind option) if the other map cannot have it under its number.
  void check(const MapSession& moved, const Sessions& there) const {
    for (const MapSession& other : there) {
      check_same_shape(target_->path(), moved.options,
                       options_of_shape(target_->path(), other.options));
      const bool is_same = other.uid == moved.uid;
      if (is_same != (other.session == moved.session)) {
        throw Error(ErrorKind::option,
                    fmt::format("Session {} of '{}' {} session {} of '{}': it keeps its number, so "
                                "that the maps need numbers of their own, by 'loopbit map create "
                                "--first-session'.",
                                other.session, target_->path(),
                                is_same ? "is a copy of" : "is another one than", moved.session,
                                source_->path()));
      }
      if (is_same && other.frames > moved.frames) {
        throw Error(ErrorKind::option,
                    fmt::format("Session {} has {} frames in '{}', but {} in '{}'; move it the "
                                "other way first.",
                                moved.session, other.frames, target_->path(), moved.frames,
                                source_->path()));
      }
    }
  }

  [[nodiscard]] Damage damage_there(int session) const {
    Damage damage;
    read_session_rows(*target_, session, nullptr, damage);
    return damage;
  }

  /// In one transaction; replaces an earlier copy.
  void copy(MapSession moved, const Sessions& there) const {
    Damage damage;
    const auto transaction = target_->begin();
    remove_session(*target_, moved.session);
    run(*target_, "DELETE FROM moved WHERE uid = ?1", moved.uid);
    RowWriter writer(*target_);
    writer.write(moved);
    moved.linked = moved.linked && std::ranges::all_of(there, [&](const MapSession& other) {
                     return other.session >= moved.session;
                   });
    if (moved.linked) writer.write_linked(moved.session);
    {
      const auto snapshot = reader_->snapshot();
      read_session_rows(*reader_, moved.session, &writer, damage);
    }
    refuse_damaged(source_->path(), damage.clauses());
    const auto owner = source_->prepare("SELECT owner FROM session WHERE uid = ?1");
    owner->bind(1, std::string_view(moved.uid));
    if (owner->step()) {
      run(*target_, "UPDATE session SET owner = ?2 WHERE uid = ?1", moved.uid, owner->text(0));
    }
    transaction->end();
  }

  /// If it has not changed: `rows` are what the other map has.
  void remove(const MapSession& moved, const std::vector<SessionRow>& rows) const {
    const auto transaction = source_->begin();
    source_->hold_back_commits();
    if (session_rows(*source_, moved.session) != rows) throw changed(moved.session);
    remove_session(*source_, moved.session);
    const auto row = source_->prepare("INSERT INTO moved (uid, session) VALUES (?1, ?2)");
    row->bind(1, std::string_view(moved.uid));
    row->bind(2, std::int64_t{moved.session});
    row->run();
    transaction->end();
  }

  /// Binds the texts to the parameters of a statement without rows.
  template <typename... Texts>
  static void run(const MapDatabase& map, const std::string& sql, const Texts&... texts) {
    const auto statement = map.prepare(sql);
    int number = 0;
    (statement->bind(++number, std::string_view(texts)), ...);
    statement->run();
  }

  std::unique_ptr<MapDatabase> source_;
  std::unique_ptr<MapDatabase> reader_;  ///< of the source
  std::unique_ptr<MapDatabase> target_;
};

/// The places that are dropped, but not with their session. What is added later is not among them.
std::vector<std::int64_t> thinned_places(const std::string& address, const CompactOptions& options,
                                         CompactCounts& counts) {
  MapReader map(address);
  map.begin_snapshot();
  (void)sessions_but(map, options.drop_sessions);
  const std::set<std::int64_t> kept = remaining_places(map, options);
  counts.places_after = static_cast<std::int64_t>(kept.size());
  std::vector<std::int64_t> thinned;
  map.for_each_place([&](const MapPlace& place) {
    ++counts.places_before;
    if (kept.contains(place.id) ||
        std::ranges::count(options.drop_sessions, place.at.session) > 0) {
      return;
    }
    thinned.push_back(place.id);
  });
  refuse_damaged(map.path(), map.damage());
  return thinned;
}

}  // namespace

std::vector<MapSession> sessions_but(const MapReader& map, const std::vector<int>& dropped) {
  std::vector<MapSession> sessions = map.sessions();
  for (const int number : std::set<int>(dropped.begin(), dropped.end())) {
    const auto removed = std::erase_if(
        sessions, [&](const MapSession& session) { return session.session == number; });
    if (removed == 0) throw unknown_session(map.path(), number);
  }
  return sessions;
}

CompactCounts compact_on_server(const std::string& address, const CompactOptions& options) {
  const auto database = open_map(address, MapDatabase::Access::link);
  check_owns(*database);
  CompactCounts counts{.bytes_before = static_cast<std::uintmax_t>(database->bytes())};
  const std::vector<std::int64_t> thinned = thinned_places(address, options, counts);
  const auto transaction = database->begin();
  for (const int session : options.drop_sessions) {
    for (const char* table : {"relative_pose", "rejected", "loop"}) {
      remove_rows(*database, table, "match_session", session);
    }
    remove_session(*database, session);
  }
  const auto row = database->prepare("DELETE FROM place WHERE place = ?1");
  for (const std::int64_t place : thinned) {
    row->bind(1, place);
    row->run();
  }
  if (options.drop_images) database->prepare("DELETE FROM image")->run();
  transaction->end();
  (void)database->prepare("VACUUM place, features, image, loop, rejected, relative_pose")->step();
  counts.bytes_after = static_cast<std::uintmax_t>(database->bytes());
  return counts;
}

MoveCounts move_sessions(const std::string& from, const std::string& to,
                         const std::vector<int>& sessions) {
  for (const std::string& path : {from, to}) {
    if (is_map_address(path)) continue;
    throw Error(ErrorKind::option,
                fmt::format("'{}' is a map file, but sessions are moved between servers; 'loopbit "
                            "map merge' copies them from and to files.",
                            path));
  }
  SessionMove move(from, to);
  MoveCounts counts;
  for (const int session : sessions) move.move(session, counts);
  return counts;
}

}  // namespace loopbit
