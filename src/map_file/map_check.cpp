// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/map_tools.hpp"

#include "map_copy.hpp"
#include "map_log.hpp"
#include "map_schema.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

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

/// A copy of a map whose first page, where the tables are listed, cannot be read, with that page
/// from a new map: tables begin at the same pages in every map. Removed when this is.
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

  /// Of a map without rows, but of so many bytes.
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
  const Database database = open_map_for_writing(to);
  MapCheck counts = copy_whole(source, plan, database);
  counts.damage = source.damage();
  close_log(database);
  return counts;
}

/// The places that images are listed of, in order.
std::vector<std::int64_t> listed_images(const std::string& path, Damage& damage) {
  std::vector<std::int64_t> places;
  for_each_image(
      open_map_for_reading(path),
      [&](std::int64_t place, std::int64_t /*bytes*/) { places.push_back(place); }, damage);
  return places;
}

bool has_whole_image(const std::string& path) {
  MapReader map(path);
  bool found = false;
  map.for_each_place([&](const MapPlace& place) { found = found || map.image_of(place); });
  return found;
}

bool can_be_opened(const std::string& path) {
  try {
    const MapReader map(path);
    return true;
  } catch (const Error&) {
    return false;
  }
}

Error is_there(const std::string& path) {
  return {ErrorKind::output, fmt::format("'{}' exists; name a new file to recover to.", path)};
}

/// Throws Error (kind output) where there is a file by now.
void rename_to_new(const std::string& from, const std::string& to) {
  int failed = renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE);
  // Not every file system can tell.
  if (failed != 0 && errno == EINVAL) failed = rename(from.c_str(), to.c_str());
  if (failed == 0) return;
  throw errno == EEXIST ? is_there(to) : cannot_write(to, errno);
}

MapCheck recover_to_new(const std::string& from, const std::string& to) {
  std::error_code error;
  const bool has_page = fs::file_size(from, error) >= kMapPageBytes && !error;
  if (is_newer_map(from) || can_be_opened(from) || !has_page) {
    MapReader source(from);
    return copy_to_new(source, to);
  }
  const RepairedCopy copy(to + ".repaired");
  copy.make(from, kMapVersion);
  // Another page is where images begin, or there are none.
  if (!has_whole_image(copy.path())) copy.make(from, kFirstVersionWithImages - 1);
  MapReader source(copy.path());
  MapCheck check = copy_to_new(source, to);
  check.damage.insert(check.damage.begin(), "the file: its first page cannot be read");
  return check;
}

}  // namespace

MapCheck check_map(const std::string& path) {
  MapReader map(path);
  MapCheck check{.sessions = static_cast<std::int64_t>(map.sessions().size())};
  // A writer may add to the map in between: images are listed before their places, and sessions
  // looked for after them.
  Damage damage;
  const std::vector<std::int64_t> images = listed_images(path, damage);
  std::vector<std::int64_t> places;
  std::set<int> undescribed;
  map.for_each_place([&](const MapPlace& place) {
    undescribed.insert(place.at.session);
    if (map.features_of(place)) ++check.places;
    if (map.image_of(place)) ++check.images;
    places.push_back(place.id);
  });
  check.loops = static_cast<std::int64_t>(map.loops().size());
  check.damage = map.damage();
  const MapReader now(path);
  for (const MapSession& session : now.sessions()) undescribed.erase(session.session);
  for (const int session : undescribed) {
    check.damage.push_back(fmt::format("session {}: its description is missing", session));
  }
  for (const std::int64_t place : images) {
    if (std::binary_search(places.begin(), places.end(), place)) continue;
    damage.add(fmt::format("place {}: there is an image of it, but no place that is whole", place));
  }
  check.damage.insert(check.damage.end(), damage.clauses().begin(), damage.clauses().end());
  for (const std::string& fault : map.check_structure()) {
    check.damage.push_back(fmt::format("the file: {}", fault));
  }
  return check;
}

MapCheck recover_map(const std::string& from, const std::string& to) {
  std::error_code error;
  // A link that leads nowhere is somebody's, too.
  if (fs::exists(fs::symlink_status(to, error))) throw is_there(to);
  // Under its name there is only a whole one, whenever this is killed.
  const std::string part = to + ".part";
  if (fs::exists(part, error) && is_being_written(part)) {
    throw Error(ErrorKind::output,
                fmt::format("'{}' is being recovered by another run; wait until that ends.", to));
  }
  remove_database(part);
  remove_database(to);  // a log of a map that was there
  try {
    MapCheck check = recover_to_new(from, part);
    if (check.sessions > 0 || check.damage.empty()) {
      rename_to_new(part, to);
      return check;
    }
    throw Error(ErrorKind::input, fmt::format("Nothing of '{}' can be recovered: it is no map of "
                                              "loopbit's, or no session in it is whole; use a "
                                              "copy from before.",
                                              from));
  } catch (const Error&) {
    remove_database(part);
    throw;
  }
}

}  // namespace loopbit
