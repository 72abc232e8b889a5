// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <array>
#include <map>
#include <set>
#include <tuple>
#include <unordered_set>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/map_server.hpp"

#include "file_database.hpp"
#include "map_options.hpp"
#include "map_rows.hpp"
#include "searched_places.hpp"
#include "stored_features.hpp"

namespace loopbit {
namespace {

Error read_only(const std::string& path) {
  return {ErrorKind::option,
          fmt::format("'{}' is open to be read: use LoopDetector::query, or open it by MapWriter.",
                      path)};
}

}  // namespace

struct MapReader::Impl {
  Impl(const std::string& map_path, std::size_t cache_mb)
      : database(open_map(map_path, MapDatabase::Access::read)),
        path(database->path()),
        features(*database),
        images(*database),
        stored(cache_mb),
        sessions(read_sessions(*database, damage)) {
    if (const std::string fault = database->fault(); !fault.empty()) damage.add(fault);
    if (database->has_search()) searched.emplace(*database, stored, damage);
  }

  std::unique_ptr<MapDatabase> database;
  std::string path;
  FeatureReader features;
  ImageReader images;
  StoredFeatures stored;  ///< of the places that for_each_earlier_place() visited
  Damage damage;
  std::vector<MapSession> sessions;
  std::optional<SearchedPlaces> searched;
  std::int64_t epoch = 0;                              ///< see set_epoch(); 0 = the present one
  std::unique_ptr<MapDatabase::Transaction> snapshot;  ///< see begin_snapshot()
};

MapReader::MapReader(const std::string& path, std::size_t cache_mb)
    : impl_(std::make_unique<Impl>(path, cache_mb)) {}
MapReader::~MapReader() = default;

const std::vector<MapSession>& MapReader::sessions() const { return impl_->sessions; }
const std::vector<std::string>& MapReader::damage() const { return impl_->damage.clauses(); }
const std::string& MapReader::path() const { return impl_->path; }

LoopDetectorOptions MapReader::options() const {
  if (impl_->sessions.empty()) {
    throw Error(
        ErrorKind::input,
        fmt::format("'{}' has no session; 'loopbit run INPUT --map' adds one.", impl_->path));
  }
  return options_of_shape(impl_->path, impl_->sessions.front().options);
}

void MapReader::for_each_place(const VisitPlace& visit) {
  loopbit::for_each_place(*impl_->database, visit, impl_->damage);
}

std::vector<MapLoop> MapReader::loops() { return read_loops(*impl_->database, impl_->damage); }

std::vector<MapLoop> MapReader::rejected_loops() {
  return read_rejected_loops(*impl_->database, impl_->damage);
}

std::vector<MapOdometry> MapReader::odometry() {
  return read_odometry(*impl_->database, impl_->damage);
}

std::vector<MapLoopPose> MapReader::loop_poses() {
  return read_loop_poses(*impl_->database, impl_->damage);
}

std::vector<KnownMotion> MapReader::motions_of(const std::vector<MapLoop>& loops) {
  const auto key_of = [](const auto& loop) {
    return std::tuple(loop.query.session, loop.query.frame, loop.match.session, loop.match.frame);
  };
  std::map<std::tuple<int, int, int, int>, KnownMotion> measured;
  for (const MapLoopPose& pose : loop_poses()) measured[key_of(pose)] = pose.measured;
  std::vector<KnownMotion> motions;
  motions.reserve(loops.size());
  for (const MapLoop& loop : loops) motions.push_back(measured[key_of(loop)]);
  return motions;
}

std::optional<Features> MapReader::features_of(const MapPlace& place) {
  return impl_->features.read(place.id, place.at, impl_->damage);
}

MapImages MapReader::images() {
  MapImages images;
  for_each_image(
      *impl_->database,
      [&](std::int64_t /*place*/, std::int64_t bytes) {
        ++images.number;
        images.bytes += bytes;
      },
      impl_->damage);
  return images;
}

std::optional<std::vector<unsigned char>> MapReader::image_of(const MapPlace& place) {
  return impl_->images.read(place.id, place.at, impl_->damage);
}

std::int64_t MapReader::bytes() const { return impl_->database->bytes(); }

std::vector<std::string> MapReader::check_structure() const {
  return impl_->database->structure_faults();
}

void MapReader::check_options(const LoopDetectorOptions& options) {
  if (!sessions().empty()) check_detector(impl_->path, this->options(), options);
}

PlaceSearch* MapReader::place_search() {
  return impl_->searched && impl_->epoch == 0 ? &*impl_->searched : nullptr;
}

void MapReader::set_time_limit(std::chrono::milliseconds limit) {
  impl_->database->set_time_limit(limit);
}

void MapReader::begin_snapshot() {
  impl_->snapshot.reset();
  impl_->snapshot = impl_->database->snapshot();
  impl_->sessions = read_sessions(*impl_->database, impl_->damage);
}

void MapReader::set_epoch(std::int64_t epoch) {
  const std::int64_t last = impl_->database->epoch();
  if (epoch > 0 && epoch <= last) {
    impl_->epoch = epoch;
    return;
  }
  const std::string& path = impl_->path;
  if (last > 0) {
    throw Error(
        ErrorKind::option,
        fmt::format("The epochs of '{}' are 1 to {}; {} is none of them.", path, last, epoch));
  }
  throw Error(ErrorKind::option, fmt::format("'{}' has no epochs{}; leave the epoch out.", path,
                                             is_map_address(path) ? " yet, since it is empty"
                                                                  : ", as a map on a server has"));
}

std::int64_t MapReader::epoch() { return impl_->epoch; }

void MapReader::for_each_earlier_place(const Visit& visit) {
  impl_->stored.begin(impl_->path);
  const auto snapshot = impl_->database->snapshot();
  std::unordered_set<std::int64_t> later;
  if (impl_->epoch == 0) {
    impl_->epoch = impl_->database->epoch();
  } else {
    later = new_places(*impl_->database, {.after = impl_->epoch});
  }
  for_each_place([&](const MapPlace& place) {
    if (later.contains(place.id)) return;
    impl_->stored.add(place.id, place.at);
    visit(place.at, place.content);
  });
}

void MapReader::for_each_earlier_loop(const VisitLoop& visit) {
  const auto snapshot = impl_->database->snapshot();
  std::set<std::array<int, 4>> later;
  const auto pair = [](const MapLoop& loop) {
    return std::array{loop.query.session, loop.query.frame, loop.match.session, loop.match.frame};
  };
  if (impl_->epoch > 0) {
    for (const MapLoop& loop :
         read_new_loops(*impl_->database, "loop", {.after = impl_->epoch}, impl_->damage)) {
      later.insert(pair(loop));
    }
  }
  for (const MapLoop& loop : loops()) {
    if (!later.contains(pair(loop))) visit(loop.query, loop.match);
  }
}

std::shared_ptr<const Features> MapReader::features(PlaceId place) {
  return impl_->stored.get(place, impl_->damage, impl_->features);
}

void MapReader::add(const Detection& /*detection*/, const BinaryContent& /*content*/,
                    std::shared_ptr<const Features> /*features*/, const cv::Mat& /*image*/) {
  throw read_only(impl_->path);
}

void MapReader::remove(PlaceId /*place*/) { throw read_only(impl_->path); }

void MapReader::reject(const SessionFrame& /*query*/, const SessionFrame& /*match*/) {
  throw read_only(impl_->path);
}

}  // namespace loopbit
