// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/map_tools.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "loopbit/database.hpp"
#include "loopbit/error.hpp"

#include "map_options.hpp"
#include "map_rows.hpp"
#include "map_schema.hpp"
#include "thinning.hpp"
#include "writer_lock.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

/// Of a copy that nobody can see yet.
constexpr std::int64_t kPlacesPerTransaction = 2048;

/// The order of sessions and frames, which is that of SessionFrame's fields.
using FrameKey = std::pair<int, int>;

FrameKey key_of(const SessionFrame& at) { return {at.session, at.frame}; }

/// Writes sessions, places and loops of one map into another.
class MapCopy {
 public:
  /// `numbers`: what each session is called in `to`; those not named are left out.
  MapCopy(const Database& to, std::map<int, int> numbers)
      : to_(to), rows_(to), numbers_(std::move(numbers)) {}

  void copy_session(MapSession session) {
    session.session = numbers_.at(session.session);
    rows_.write(session);
  }

  /// False if its session is left out.
  bool copy_place(MapPlace place, const Features& features) {
    if (!renumber(place.at)) return false;
    rows_.write(place, features);
    return true;
  }

  bool copy_loop(MapLoop loop) {
    if (!renumber(loop.query) || !renumber(loop.match)) return false;
    rows_.write(loop);
    return true;
  }

  [[nodiscard]] const Database& to() const { return to_; }

 private:
  [[nodiscard]] bool renumber(SessionFrame& at) const {
    const auto found = numbers_.find(at.session);
    if (found == numbers_.end()) return false;
    at.session = found->second;
    return true;
  }

  const Database& to_;
  RowWriter rows_;
  std::map<int, int> numbers_;
};

void refuse_damaged(const MapReader& map) {
  if (map.damage().empty()) return;
  throw Error(ErrorKind::input,
              fmt::format("'{0}' is damaged ({1}, {2} in all); 'loopbit map check {0} --recover "
                          "NEW.db' saves the rest in a new map first.",
                          map.path(), map.damage().front(), map.damage().size()));
}

/// Sessions whose description is lost are given one.
std::vector<MapSession> all_sessions(MapReader& map) {
  std::map<int, MapSession> sessions;
  for (const MapSession& session : map.sessions()) sessions[session.session] = session;
  if (sessions.empty()) return {};  // nothing says what the places were made with
  const MapSession pattern = sessions.begin()->second;
  map.for_each_place([&](const MapPlace& place) {
    auto [found, is_new] = sessions.try_emplace(place.at.session, pattern);
    MapSession& session = found->second;
    if (is_new) {
      session.session = place.at.session;
      session.uid += fmt::format("-recovered-{}", place.at.session);
      session.name = "recovered";
      session.frames = 0;
    }
    session.frames = std::max<std::int64_t>(session.frames, place.at.frame + 1);
  });
  std::vector<MapSession> list;
  list.reserve(sessions.size());
  for (const auto& [number, session] : sessions) list.push_back(session);
  return list;
}

/// Copies what `keeps(place)` says to a new file, under the same numbers. Returns the number of
/// places.
template <typename Keeps>
MapCheck copy_whole(MapReader& from, const std::vector<MapSession>& sessions, const Database& to,
                    const Keeps& keeps) {
  std::map<int, int> numbers;
  for (const MapSession& session : sessions) numbers[session.session] = session.session;
  MapCopy copy(to, std::move(numbers));
  MapCheck counts;
  to.execute("BEGIN IMMEDIATE");
  for (const MapSession& session : sessions) copy.copy_session(session);
  counts.sessions = static_cast<std::int64_t>(sessions.size());
  from.for_each_place([&](const MapPlace& place) {
    if (!keeps(place)) return;
    const auto features = from.features_of(place);
    if (!features || !copy.copy_place(place, *features)) return;
    if (++counts.places % kPlacesPerTransaction == 0) to.execute("COMMIT; BEGIN IMMEDIATE");
  });
  for (const MapLoop& loop : from.loops()) counts.loops += copy.copy_loop(loop);
  to.execute("COMMIT");
  return counts;
}

/// One file without a log. False if a reader holds the log.
bool close_log(const Database& database) {
  Statement statement(database, "PRAGMA journal_mode = DELETE");
  return statement.step_if_readable() == Statement::Step::row && statement.text(0) == "delete";
}

/// The places that `options` leave, by id.
std::set<std::int64_t> remaining(MapReader& map, const CompactOptions& options) {
  const std::set<int> dropped(options.drop_sessions.begin(), options.drop_sessions.end());
  std::vector<ThinnedPlace> places;
  std::vector<std::int64_t> ids;
  std::map<FrameKey, std::size_t> index;
  map.for_each_place([&](const MapPlace& place) {
    if (dropped.contains(place.at.session)) return;
    index[key_of(place.at)] = places.size();
    places.push_back({place.content, place.at.session});
    ids.push_back(place.id);
  });
  if (options.max_places > 0) {
    for (const MapLoop& loop : map.loops()) {
      const auto query = index.find(key_of(loop.query));
      const auto match = index.find(key_of(loop.match));
      if (query != index.end() && match != index.end() && query != match) {
        places[query->second].loop = match->second;
      }
    }
    const auto kept = kept_places(places, static_cast<std::size_t>(options.max_places));
    std::size_t position = 0;
    std::erase_if(ids, [&](std::int64_t) { return !kept[position++]; });
  }
  return {ids.begin(), ids.end()};
}

std::vector<MapSession> sessions_but(const MapReader& map, const std::vector<int>& dropped) {
  std::vector<MapSession> sessions = map.sessions();
  for (const int number : dropped) {
    const auto removed = std::erase_if(
        sessions, [&](const MapSession& session) { return session.session == number; });
    if (removed == 0) {
      throw Error(ErrorKind::option, fmt::format("'{0}' has no session {1}; 'loopbit map list {0}' "
                                                 "shows those there are.",
                                                 map.path(), number));
    }
  }
  return sessions;
}

/// Keys are never given twice, not even those of what was dropped last.
void keep_sequences(const Database& from, const Database& to) {
  for (const char* table : {"session", "place"}) {
    const auto last =
        from.integer(fmt::format("SELECT seq FROM sqlite_sequence WHERE name = '{}'", table));
    to.execute(
        fmt::format("DELETE FROM sqlite_sequence WHERE name = '{0}'; INSERT INTO "
                    "sqlite_sequence VALUES ('{0}', {1})",
                    table, last));
  }
}

}  // namespace

MapCheck check_map(const std::string& path) {
  MapReader map(path);
  MapCheck check{.sessions = static_cast<std::int64_t>(map.sessions().size())};
  std::set<int> described;
  for (const MapSession& session : map.sessions()) described.insert(session.session);
  std::set<int> undescribed;
  map.for_each_place([&](const MapPlace& place) {
    if (!described.contains(place.at.session)) undescribed.insert(place.at.session);
    if (map.features_of(place)) ++check.places;
  });
  check.loops = static_cast<std::int64_t>(map.loops().size());
  check.damage = map.damage();
  for (const int session : undescribed) {
    check.damage.push_back(fmt::format("session {}: its description is missing", session));
  }
  for (const std::string& fault : map.check_structure()) {
    check.damage.push_back(fmt::format("the file: {}", fault));
  }
  return check;
}

MergeCounts merge_map(const std::string& into, const std::string& from) {
  MapReader source(from);
  const WriterLock lock(into);
  const Database to = open_map_for_writing(into);
  Damage damage;
  std::map<std::string, int> known;
  std::string options;
  for (const MapSession& session : read_sessions(to, damage)) {
    known[session.uid] = session.session;
    options = session.options;
  }
  MergeCounts counts;
  std::map<int, int> numbers;
  int next = next_session(to);
  std::vector<MapSession> added;
  for (const MapSession& session : source.sessions()) {
    if (options.empty()) options = session.options;
    check_same_shape(into, options, options_of_shape(from, session.options));
    const auto found = known.find(session.uid);
    numbers[session.session] = found != known.end() ? found->second : next;
    if (found != known.end()) {
      ++counts.known;
      continue;
    }
    ++next;
    added.push_back(session);
  }
  std::set<int> added_numbers;
  for (const MapSession& session : added) added_numbers.insert(session.session);
  MapCopy copy(to, numbers);
  std::int64_t id = next_place(to);
  to.execute("BEGIN IMMEDIATE");
  for (const MapSession& session : added) copy.copy_session(session);
  source.for_each_place([&](MapPlace place) {
    if (!added_numbers.contains(place.at.session)) return;
    const auto features = source.features_of(place);
    if (!features) return;
    place.id = id++;
    counts.places += copy.copy_place(place, *features);
  });
  for (const MapLoop& loop : source.loops()) {
    if (added_numbers.contains(loop.query.session)) counts.loops += copy.copy_loop(loop);
  }
  refuse_damaged(source);  // and leave the transaction: nothing is copied
  to.execute("COMMIT");
  counts.sessions = static_cast<std::int64_t>(added.size());
  close_log(to);
  return counts;
}

MapCheck recover_map(const std::string& from, const std::string& to) {
  if (fs::exists(to)) {
    throw Error(ErrorKind::output, fmt::format("'{}' exists; name a new file to recover to.", to));
  }
  MapReader source(from);
  const std::vector<MapSession> sessions = all_sessions(source);
  const WriterLock lock(to);
  const Database database = open_map_for_writing(to);
  MapCheck counts = copy_whole(source, sessions, database, [](const MapPlace&) { return true; });
  counts.damage = source.damage();
  close_log(database);
  return counts;
}

CompactCounts compact_map(const std::string& path, const CompactOptions& options) {
  const WriterLock lock(path);
  const std::string part = path + ".compact";
  fs::remove(part);
  CompactCounts counts;
  {
    MapReader map(path);
    const auto sessions = sessions_but(map, options.drop_sessions);
    const auto kept = remaining(map, options);
    const Database old = open_map_for_writing(path);
    const Database compact = open_map_for_writing(part);
    map.for_each_place([&](const MapPlace&) { ++counts.places_before; });
    counts.places_after = copy_whole(map, sessions, compact, [&](const MapPlace& place) {
                            return kept.contains(place.id);
                          }).places;
    refuse_damaged(map);
    keep_sequences(old, compact);
    close_log(compact);
  }
  {
    const Database old = open_map_for_writing(path);
    if (!close_log(old)) {
      fs::remove(part);
      throw Error(ErrorKind::output,
                  fmt::format("'{}' is being read by another process; end that, then compact "
                              "again. Nothing was changed.",
                              path));
    }
  }
  counts.bytes_before = fs::file_size(path);
  counts.bytes_after = fs::file_size(part);
  std::error_code error;
  fs::rename(part, path, error);
  if (error) throw cannot_write(path, error.value());
  return counts;
}

}  // namespace loopbit
