// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <cerrno>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "loopbit/error.hpp"
#include "loopbit/map_tools.hpp"
#include "loopbit/write_file.hpp"

#include "map_copy.hpp"
#include "map_log.hpp"
#include "map_schema.hpp"
#include "thinning.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

using FrameKey = std::pair<int, int>;

FrameKey key_of(const SessionFrame& at) { return {at.session, at.frame}; }

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
  for (const int number : std::set<int>(dropped.begin(), dropped.end())) {
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

/// Makes the empty file `part` with the mode of the one at `path`, and its owner and group as far
/// as that is permitted.
void make_alike(const std::string& part, const std::string& path) {
  constexpr mode_t kOwnerOnly = 0600;
  constexpr mode_t kAllModes = 07777;
  const int file = open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kOwnerOnly);
  if (file < 0) throw cannot_write(part, errno);
  struct stat old {};
  const bool is_alike = stat(path.c_str(), &old) == 0 && fchmod(file, old.st_mode & kAllModes) == 0;
  const int reason = errno;
  // Only root gives files away; others may give them to a group of theirs.
  const bool is_given = is_alike && (fchown(file, old.st_uid, old.st_gid) == 0 ||
                                     fchown(file, geteuid(), old.st_gid) == 0);
  (void)is_given;
  close(file);
  if (!is_alike) throw cannot_write(part, reason);
}

/// Writes what remains of the map `old` to the new file `part`.
void write_compact(const Database& old, const std::string& part, const CompactOptions& options,
                   CompactCounts& counts) {
  MapReader map(old.path());
  CopyPlan plan{.sessions = sessions_but(map, options.drop_sessions),
                .keeps_place = {},
                .keeps_images = !options.drop_images};
  const auto kept = remaining(map, options);
  plan.keeps_place = [&](const MapPlace& place) { return kept.contains(place.id); };
  map.for_each_place([&](const MapPlace&) { ++counts.places_before; });
  make_alike(part, old.path());
  const Database compact = open_map_for_writing(part);
  counts.places_after = copy_whole(map, plan, compact).places;
  refuse_damaged(map.path(), map.damage());
  keep_sequences(old, compact);
  close_log(compact);
}

/// The log of the old file would be taken for the new one's.
void check_unused(const Database& old) {
  if (!close_log(old)) {
    throw Error(ErrorKind::output,
                fmt::format("'{}' is being read by another process; end that, then compact again. "
                            "Nothing was changed.",
                            old.path()));
  }
  old.execute("BEGIN EXCLUSIVE; ROLLBACK");
}

}  // namespace

CompactCounts compact_map(const std::string& path, const CompactOptions& options) {
  (void)open_map_for_reading(path);  // or one would be made
  const Database old = open_map_for_writing(path);
  const std::string file = resolved_path(path);
  const std::string part = file + ".compact";
  remove_database(part);
  CompactCounts counts;
  try {
    write_compact(old, part, options, counts);
    check_unused(old);
    std::error_code error;
    counts.bytes_before = fs::file_size(file, error);
    if (!error) counts.bytes_after = fs::file_size(part, error);
    if (!error) fs::rename(part, file, error);
    if (error) throw cannot_write(path, error.value());
  } catch (const Error&) {
    remove_database(part);
    throw;
  }
  return counts;
}

}  // namespace loopbit
