// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The tools that copy the rows of one map to another: merging, recovering and compacting.
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "loopbit/error.hpp"
#include "loopbit/map_server.hpp"
#include "loopbit/map_tools.hpp"
#include "loopbit/write_file.hpp"

#include "file_database.hpp"
#include "map_log.hpp"
#include "map_options.hpp"
#include "map_rows.hpp"
#include "map_schema.hpp"
#include "server_tools.hpp"
#include "thinning.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kPlacesPerTransaction = 2048;

/// Copies rows of one map to another.
class MapCopy {
 public:
  /// `numbers`: the number in `to` of each session that is copied.
  MapCopy(const MapDatabase& to, std::map<int, int> numbers)
      : to_(to), rows_(to), numbers_(std::move(numbers)) {}

  void copy_session(MapSession session) {
    session.session = numbers_.at(session.session);
    rows_.write(session);
    if (session.linked) rows_.write_linked(session.session);
  }

  /// False if its session is not copied. `image`: may be empty.
  bool copy_place(const MapPlace& place, const Features& features,
                  const std::vector<unsigned char>& image) {
    MapPlace copied = place;
    if (!renumber(copied.at)) return false;
    rows_.write(copied, features);
    rows_.write_image(copied, image);
    return true;
  }

  /// False if one of its sessions is not copied.
  bool copy_loop(MapLoop loop) {
    if (!renumber(loop.query) || !renumber(loop.match)) return false;
    rows_.write(loop);
    return true;
  }

  /// The same for a rejected one.
  void copy_rejected(MapLoop loop) {
    if (renumber(loop.query) && renumber(loop.match)) rows_.write_rejected(loop);
  }

  /// Rejects it in `to`, which may have it as a loop.
  void reject(MapLoop loop) {
    if (renumber(loop.query) && renumber(loop.match)) reject_loop(to_, loop);
  }

  void copy_odometry(MapOdometry odometry) {
    if (renumber(odometry.at)) rows_.write(odometry);
  }

  void copy_pose(MapLoopPose pose) {
    if (renumber(pose.query) && renumber(pose.match)) rows_.write(pose);
  }

 private:
  [[nodiscard]] bool renumber(SessionFrame& at) const {
    const auto found = numbers_.find(at.session);
    if (found == numbers_.end()) return false;
    at.session = found->second;
    return true;
  }

  const MapDatabase& to_;
  RowWriter rows_;
  std::map<int, int> numbers_;
};

/// Which rows of a map are copied.
struct CopyPlan {
  std::vector<MapSession> sessions;  ///< with their loops
  std::function<bool(const MapPlace&)> keeps_place;
  bool keeps_images = true;
};

/// Copies the planned rows under the same numbers to a new map that nobody can see yet. Returns the
/// counts of copied rows.
MapCheck copy_whole(MapReader& from, const CopyPlan& plan, const MapDatabase& to) {
  std::map<int, int> numbers;
  for (const MapSession& session : plan.sessions) numbers[session.session] = session.session;
  MapCopy copy(to, std::move(numbers));
  MapCheck counts;
  auto transaction = to.begin();
  for (const MapSession& session : plan.sessions) copy.copy_session(session);
  counts.sessions = static_cast<std::int64_t>(plan.sessions.size());
  from.for_each_place([&](const MapPlace& place) {
    if (!plan.keeps_place(place)) return;
    const auto features = from.features_of(place);
    const auto image = plan.keeps_images ? from.image_of(place) : std::nullopt;
    if (!features ||
        !copy.copy_place(place, *features, image.value_or(std::vector<unsigned char>{})))
      return;
    counts.images += image.has_value();
    if (++counts.places % kPlacesPerTransaction == 0) {
      transaction->end();
      transaction.reset();
      transaction = to.begin();
    }
  });
  for (const MapLoop& loop : from.loops()) counts.loops += copy.copy_loop(loop);
  for (const MapLoop& loop : from.rejected_loops()) copy.copy_rejected(loop);
  for (const MapOdometry& odometry : from.odometry()) copy.copy_odometry(odometry);
  for (const MapLoopPose& pose : from.loop_poses()) copy.copy_pose(pose);
  transaction->end();
  return counts;
}

// Merging.

/// Which sessions are added, and under which numbers.
struct MergePlan {
  std::map<int, int> numbers;         ///< from numbers in the other map to numbers in this one
  std::vector<MapSession> added;      ///< those that this one lacks
  std::vector<MapSession> continued;  ///< those of which it has fewer frames
  std::map<int, KnownRows> had;       ///< by number in the other map: what this one has
  std::set<int> whole;                ///< sessions of `had` that are not continued

  /// Of a loop of `query` or its pose, with numbers of the other map; none if its match is in
  /// neither.
  [[nodiscard]] std::optional<KnownRows::Pair> pair(const SessionFrame& query,
                                                    SessionFrame match) const {
    const auto number = numbers.find(match.session);
    if (number == numbers.end()) return std::nullopt;
    match.session = number->second;
    return KnownRows::pair(query, match);
  }

  /// Of the other map's session, for what it adds to this one.
  [[nodiscard]] const KnownRows& had_of(int session) const {
    static const KnownRows nothing;
    const auto found = had.find(session);
    return found == had.end() ? nothing : found->second;
  }
};

/// Throws Error (kind option) if settings differ.
MergePlan plan_of(const MapDatabase& to, const MapReader& source) {
  Damage damage;
  std::map<std::string, MapSession> known;
  std::string options;
  // A session without frames may be one of another server, which a queue describes. Loops that lead
  // to it keep its number.
  const bool is_server = is_map_address(to.path());
  std::vector<int> described;
  for (const MapSession& session : read_sessions(to, damage)) {
    known[session.uid] = session;
    options = session.options;
  }
  refuse_damaged(to.path(),
                 damage.clauses());  // a session with an unknown uid could be added twice
  std::map<int, KnownRows> rows = known_rows(to);
  MergePlan plan;
  for (const MapSession& session : source.sessions()) {
    if (options.empty()) options = session.options;
    check_same_shape(to.path(), options, options_of_shape(source.path(), session.options));
    if (const auto found = known.find(session.uid); found != known.end()) {
      plan.numbers[session.session] = found->second.session;
      plan.had[session.session] = rows[found->second.session];
      if (session.frames > found->second.frames) {
        plan.continued.push_back(session);
        plan.continued.back().linked = false;  // or it says so already
      } else {
        plan.whole.insert(session.session);
      }
    } else if (is_server && session.frames == 0) {
      described.push_back(session.session);
    } else {
      plan.added.push_back(session);
      // Those of `into` that come before it now are new to it.
      if (!known.empty()) plan.added.back().linked = false;
    }
  }
  const std::vector<int> numbers = to.new_sessions(plan.added.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    plan.numbers[plan.added[i].session] = numbers[i];
  }
  for (const int session : described) {
    const bool is_other = std::ranges::any_of(
        known, [&](const auto& each) { return each.second.session == session; });
    if (!is_other) plan.numbers[session] = session;
  }
  return plan;
}

/// The next merge would take an incomplete session for a known one.
void refuse_unfinished(const std::string& from) {
  const auto database = open_map(from, MapDatabase::Access::read);
  if (!database->is_being_written()) return;
  throw Error(ErrorKind::input, fmt::format("'{}' is being written: only a part of its session "
                                            "would be copied; merge it when its run has ended.",
                                            database->path()));
}

/// Copies loops, what was rejected, and poses that are not there. Returns the number of loops.
std::int64_t copy_loops(const MergePlan& plan, MapReader& source, MapCopy& copy) {
  for (const MapLoop& loop : source.rejected_loops()) {
    const auto pair = plan.pair(loop.query, loop.match);
    if (pair && !plan.had_of(loop.query.session).rejected.contains(*pair)) copy.reject(loop);
  }
  std::int64_t number = 0;
  for (const MapLoop& loop : source.loops()) {
    if (plan.whole.contains(loop.query.session)) continue;
    const auto pair = plan.pair(loop.query, loop.match);
    const KnownRows& had = plan.had_of(loop.query.session);
    if (!pair || had.loops.contains(*pair) || had.rejected.contains(*pair)) continue;
    number += copy.copy_loop(loop);
  }
  for (const MapLoopPose& pose : source.loop_poses()) {
    const auto pair = plan.pair(pose.query, pose.match);
    if (pair && !plan.had_of(pose.query.session).poses.contains(*pair)) copy.copy_pose(pose);
  }
  return number;
}

/// Adds to `to` what it lacks of the sessions of `source`, in one transaction.
MergeCounts merge(const MapDatabase& to, MapReader& source) {
  const MergePlan plan = plan_of(to, source);
  MergeCounts counts{.sessions = static_cast<std::int64_t>(plan.added.size()),
                     .known = static_cast<std::int64_t>(plan.whole.size()),
                     .continued = static_cast<std::int64_t>(plan.continued.size())};
  to.prepare_long_transaction();
  const auto transaction = to.begin();
  MapCopy copy(to, plan.numbers);
  std::int64_t id = 0;
  for (const MapSession& session : plan.added) copy.copy_session(session);
  for (const MapSession& session : plan.continued) copy.copy_session(session);
  source.for_each_place([&](const MapPlace& place) {
    if (!plan.numbers.contains(place.at.session)) return;  // it is damaged
    if (place.at.frame < plan.had_of(place.at.session).frames) return;
    const auto features = source.features_of(place);
    if (!features) return;
    MapPlace copied = place;
    id = to.place_key({plan.numbers.at(place.at.session), place.at.frame}, id);
    copied.id = id;
    counts.places += copy.copy_place(copied, *features,
                                     source.image_of(place).value_or(std::vector<unsigned char>{}));
  });
  counts.loops = copy_loops(plan, source, copy);
  for (const MapOdometry& odometry : source.odometry()) {
    if (odometry.at.frame >= plan.had_of(odometry.at.session).frames) copy.copy_odometry(odometry);
  }
  refuse_damaged(source.path(), source.damage());
  transaction->end();
  return counts;
}

// Recovering.

/// All sessions; those whose description is lost get a new one.
std::vector<MapSession> all_sessions(MapReader& map) {
  std::map<int, MapSession> sessions;
  for (const MapSession& session : map.sessions()) sessions[session.session] = session;
  if (sessions.empty()) return {};  // the settings of the places are unknown
  const MapSession pattern = sessions.begin()->second;
  map.for_each_place([&](const MapPlace& place) {
    auto [found, is_new] = sessions.try_emplace(place.at.session, pattern);
    MapSession& session = found->second;
    if (is_new) {
      session.session = place.at.session;
      session.uid += fmt::format("-recovered-{}", place.at.session);
      session.name = "recovered";
      session.linked = false;
      session.frames = 0;
    }
    session.frames = std::max<std::int64_t>(session.frames, place.at.frame + 1);
  });
  std::vector<MapSession> list;
  list.reserve(sessions.size());
  for (const auto& [number, session] : sessions) list.push_back(session);
  return list;
}

/// A temporary copy of a map whose first page, which lists the tables, cannot be read. That page is
/// taken from a new map, since tables begin at the same pages in every map.
class RepairedCopy {
 public:
  explicit RepairedCopy(std::string path) : path_(std::move(path)) {}
  ~RepairedCopy() { remove_database(path_); }
  RepairedCopy(const RepairedCopy&) = delete;
  RepairedCopy& operator=(const RepairedCopy&) = delete;
  RepairedCopy(RepairedCopy&&) = delete;
  RepairedCopy& operator=(RepairedCopy&&) = delete;

  /// `version`: of the map at `from`. Throws Error (kind output).
  void make(const std::string& from, int version) const {
    remove_database(path_);
    const Page page = first_page(fs::file_size(from), version);
    std::error_code error;
    fs::copy_file(from, path_, fs::copy_options::overwrite_existing, error);
    if (error) throw cannot_write(path_, error.value());
    std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
    file.write(page.data(), page.size());
    if (!file.flush()) throw cannot_write(path_, errno);
  }

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  using Page = std::array<char, kMapPageBytes>;

  /// The first page of an empty map, but for the number of pages, which is that of `bytes`.
  [[nodiscard]] Page first_page(std::uintmax_t bytes, int version) const {
    close_log(open_map_for_writing(path_, version));
    Page page{};
    std::ifstream(path_, std::ios::binary).read(page.data(), page.size());
    // sqlite.org/fileformat2.html, 1.3.7: the size in pages, big-endian, at byte 28.
    const auto pages = static_cast<std::uint32_t>(bytes / kMapPageBytes);
    for (std::size_t i = 0; i < 4; ++i) {
      page.at(28 + i) = static_cast<char>(pages >> (24 - 8 * i));
    }
    return page;
  }

  std::string path_;
};

MapCheck copy_to_new(MapReader& source, const std::string& to) {
  const CopyPlan plan{.sessions = all_sessions(source),
                      .keeps_place = [](const MapPlace&) { return true; }};
  FileDatabase database(open_map_for_writing(to));
  MapCheck counts = copy_whole(source, plan, database);
  counts.damage = source.damage();
  database.close();
  return counts;
}

bool has_whole_image(const std::string& path) {
  MapReader map(path);
  bool found = false;
  map.for_each_place([&](const MapPlace& place) { found = found || map.image_of(place); });
  return found;
}

/// Whether `linked` and `rejected` begin where a map of the version that has them has them.
bool has_whole_links(const std::string& path) {
  const FileDatabase database(open_map_for_reading(path));
  Damage damage;
  (void)read_rejected_loops(database, damage);
  const std::size_t before = damage.clauses().size();
  (void)read_sessions(database, damage);
  return before == 0 &&
         std::none_of(damage.clauses().begin(), damage.clauses().end(),
                      [](const std::string& clause) { return clause.starts_with("linked"); });
}

/// The same for `odometry` and `relative_pose`.
bool has_whole_odometry(const std::string& path) {
  const FileDatabase database(open_map_for_reading(path));
  Damage damage;
  (void)read_odometry(database, damage);
  (void)read_loop_poses(database, damage);
  return damage.clauses().empty();
}

bool can_be_opened(const std::string& path) {
  try {
    const MapReader map(path);
    return true;
  } catch (const Error&) {
    return false;
  }
}

Error already_there(const std::string& path) {
  return {ErrorKind::output, fmt::format("'{}' exists; name a new file to recover to.", path)};
}

/// Throws Error (kind output) if `to` exists by now.
void rename_to_new(const std::string& from, const std::string& to) {
  int failed = renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE);
  // Not every file system supports RENAME_NOREPLACE.
  if (failed != 0 && errno == EINVAL) failed = rename(from.c_str(), to.c_str());
  if (failed == 0) return;
  throw errno == EEXIST ? already_there(to) : cannot_write(to, errno);
}

/// Of the version that the map began with: where an older one has other rows, later tables would
/// begin.
void make_first_page(const RepairedCopy& copy, const std::string& from) {
  copy.make(from, kMapVersion);
  if (has_whole_odometry(copy.path())) return;
  copy.make(from, kFirstVersionWithOdometry - 1);
  if (has_whole_links(copy.path())) return;
  copy.make(from, kFirstVersionWithLinks - 1);
  if (has_whole_image(copy.path())) return;
  copy.make(from, kFirstVersionWithImages - 1);
}

MapCheck recover_to_new(const std::string& from, const std::string& to) {
  std::error_code error;
  const bool has_page = fs::file_size(from, error) >= kMapPageBytes && !error;
  if (is_map_address(from) || is_newer_map(from) || can_be_opened(from) || !has_page) {
    MapReader source(from);
    return copy_to_new(source, to);
  }
  const RepairedCopy copy(to + ".repaired");
  make_first_page(copy, from);
  MapReader source(copy.path());
  MapCheck check = copy_to_new(source, to);
  check.damage.insert(check.damage.begin(), "the file: its first page cannot be read");
  return check;
}

// Compacting.

/// Keys are never reused, not even those of the rows dropped last.
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
  // Only root may change the owner; others may choose a group of theirs.
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
  const auto kept = remaining_places(map, options);
  plan.keeps_place = [&](const MapPlace& place) { return kept.contains(place.id); };
  map.for_each_place([&](const MapPlace&) { ++counts.places_before; });
  make_alike(part, old.path());
  FileDatabase compact(open_map_for_writing(part));
  counts.places_after = copy_whole(map, plan, compact).places;
  refuse_damaged(map.path(), map.damage());
  keep_sequences(old, compact.file());
  compact.close();
}

/// A log beside the old file would be taken for that of the new one.
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

MergeCounts merge_map(const std::string& into, const std::string& from) {
  auto source = std::make_unique<MapReader>(from);
  refuse_unfinished(from);
  const auto to = open_map(into, MapDatabase::Access::write);
  try {
    const MergeCounts counts = merge(*to, *source);
    source.reset();  // it may read the same map
    to->close();
    return counts;
  } catch (...) {
    source.reset();
    to->close();
    throw;
  }
}

MapCheck recover_map(const std::string& from, const std::string& to) {
  if (is_map_address(to)) {
    throw Error(ErrorKind::option,
                fmt::format("'{0}' is on a server, but maps are recovered to a file; give NEW.db, "
                            "and 'loopbit map merge {0} NEW.db' adds it.",
                            without_secrets(to)));
  }
  std::error_code error;
  // A broken symbolic link is not replaced, either.
  if (fs::exists(fs::symlink_status(to, error))) throw already_there(to);
  // The map gets its name when it is complete, so a kill leaves no half of one.
  const std::string part = to + ".part";
  if (fs::exists(part, error) && is_being_written(part)) {
    throw Error(ErrorKind::output,
                fmt::format("'{}' is being recovered by another run; wait until that ends.", to));
  }
  remove_database(part);
  remove_database(to);  // the log of an earlier map
  try {
    MapCheck check = recover_to_new(from, part);
    if (check.sessions > 0 || check.damage.empty()) {
      rename_to_new(part, to);
      return check;
    }
    throw Error(ErrorKind::input, fmt::format("Nothing of '{}' can be recovered: it is no map of "
                                              "loopbit's, or no session in it is whole; use a "
                                              "copy from before.",
                                              without_secrets(from)));
  } catch (...) {
    remove_database(part);
    throw;
  }
}

CompactCounts compact_map(const std::string& path, const CompactOptions& options) {
  if (is_map_address(path)) return compact_on_server(path, options);
  (void)open_map_for_reading(path);  // it must exist
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
  } catch (...) {
    remove_database(part);
    throw;
  }
  return counts;
}

}  // namespace loopbit
