// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "loopbit/map_tools.hpp"

#include "file_database.hpp"
#include "map_rows.hpp"

namespace loopbit {
namespace {

/// The places that have an image, in order.
std::vector<std::int64_t> listed_images(const std::string& path, Damage& damage) {
  std::vector<std::int64_t> places;
  for_each_image(
      *open_map(path, MapDatabase::Access::read),
      [&](std::int64_t place, std::int64_t /*bytes*/) { places.push_back(place); }, damage);
  return places;
}

}  // namespace

MapCheck check_map(const std::string& path) {
  MapReader map(path);
  MapCheck check{.sessions = static_cast<std::int64_t>(map.sessions().size())};
  // A writer may add to the map meanwhile. So images are listed before their places, and sessions
  // after them.
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
  // These add to the damage.
  (void)map.rejected_loops();
  (void)map.odometry();
  (void)map.loop_poses();
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

}  // namespace loopbit
