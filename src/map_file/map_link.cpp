// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "loopbit/loop_detector.hpp"
#include "loopbit/map_tools.hpp"
#include "loopbit/version.hpp"

#include "file_database.hpp"
#include "map_options.hpp"
#include "map_rows.hpp"
#include "stored_features.hpp"

namespace loopbit {
namespace {

/// Longer stretches without a place are as good as this one: no setting of use reaches further.
constexpr std::int64_t kMaxSkipped = 1000;

/// The places of a session in order of frame.
std::vector<MapPlace> places_of(const MapDatabase& database, int session, Damage& damage) {
  std::vector<MapPlace> places;
  for_each_place(
      database,
      [&](const MapPlace& place) {
        if (place.at.session == session) places.push_back(place);
      },
      damage);
  const auto frame = [](const MapPlace& place) { return place.at.frame; };
  std::ranges::stable_sort(places, {}, frame);
  return places;
}

using OdometryByFrame = std::map<std::int64_t, OdometryPose>;

OdometryByFrame odometry_of(const MapDatabase& database, int session, Damage& damage) {
  OdometryByFrame poses;
  for (const MapOdometry& odometry : read_odometry(database, damage)) {
    if (odometry.at.session == session) poses[odometry.at.frame] = odometry.pose;
  }
  return poses;
}

/// A map as it was for the detector of one of its sessions, whose frames are processed again.
class MapBefore : public MapStorage {
 public:
  MapBefore(std::string path, const MapDatabase& database, int session)
      : path_(std::move(path)),
        database_(database),
        session_(session),
        reader_(database),
        stored_(kMapCache_mb) {}

  void check_options(const LoopDetectorOptions& /*options*/) override {}  // link_map() does

  void for_each_earlier_place(const Visit& visit) override {
    stored_.begin(path_);
    for_each_place(
        database_,
        [&](const MapPlace& place) {
          if (place.at.session >= session_) return;
          stored_.add(place.id, place.at);
          visit(place.at, place.content);
        },
        damage_);
  }

  void for_each_earlier_loop(const VisitLoop& visit) override {
    for (const MapLoop& loop : read_loops(database_, damage_)) {
      if (loop.query.session < session_) visit(loop.query, loop.match);
    }
  }

  std::shared_ptr<const Features> features(PlaceId place) override {
    return stored_.get(place, damage_, reader_);
  }

  /// The place that is processed next; null if the next frame has none.
  void announce(const MapPlace* place) { next_ = place; }

  void add(const Detection& /*detection*/, const BinaryContent& /*content*/,
           std::shared_ptr<const Features> features, const cv::Mat& /*image*/) override {
    const PlaceId number = stored_.size();
    stored_.add(next_ ? next_->id : StoredFeatures::kNoRow, next_ ? next_->at : SessionFrame{});
    stored_.keep(number, std::move(features));
  }

  void remove(PlaceId /*place*/) override {}                                             // unused
  void reject(const SessionFrame& /*query*/, const SessionFrame& /*match*/) override {}  // known

  [[nodiscard]] Damage& damage() { return damage_; }

 private:
  std::string path_;
  const MapDatabase& database_;
  int session_;
  FeatureReader reader_;
  StoredFeatures stored_;
  const MapPlace* next_ = nullptr;
  Damage damage_;
};

/// Frames of one session, each with the session of its match.
class FramePairs {
 public:
  FramePairs(const std::vector<MapLoop>& loops, int session) {
    for (const MapLoop& loop : loops) {
      if (loop.query.session == session) pairs_.insert({loop.query.frame, loop.match.session});
    }
  }

  [[nodiscard]] bool contain(const MapLoop& loop) const {
    return pairs_.contains({loop.query.frame, loop.match.session});
  }

 private:
  std::set<std::pair<int, int>> pairs_;
};

/// Processes the frames of a session again.
class Relived {
 public:
  /// `database` must outlive it.
  Relived(const std::string& path, const MapDatabase& database, int session,
          const LoopDetectorOptions& options)
      : path_(path),
        session_(session),
        map_(std::make_shared<MapBefore>(path, database, session)),
        odometry_(odometry_of(database, session, map_->damage())),
        reader_(database),
        known_(read_loops(database, map_->damage()), session),
        rejected_(read_rejected_loops(database, map_->damage()), session),
        detector_(options, map_) {}

  /// Takes the next place, and adds to `found` the loops that the map does not have, also late
  /// ones. Those that are withdrawn are taken out again.
  void process(const MapPlace& place, std::vector<MapLoop>& found) {
    skip_to(place.at.frame);
    auto features = reader_.read(place.id, place.at, map_->damage());
    refuse_damaged(path_, map_->damage().clauses());
    map_->announce(&place);
    const Detection detection = detector_.process(place.content, std::move(*features),
                                                  place.timestamp_s, odometry_at(place.at.frame));
    refuse_damaged(path_, map_->damage().clauses());
    frames_.push_back(place.at.frame);
    if (detection.status == Status::loop) {
      add(loop_of(detection, session_), found);
    }
    for (const LateLoop& loop : detection.withdrawn_loops) {
      const MapLoop withdrawn = in_session(loop_of(loop, session_));
      std::erase_if(found, [&](const MapLoop& other) {
        return other.query == withdrawn.query && other.match == withdrawn.match;
      });
    }
    for (const LateLoop& loop : detection.late_loops) {
      add(loop_of(loop, session_), found);
    }
  }

 private:
  [[nodiscard]] std::optional<OdometryPose> odometry_at(std::int64_t frame) const {
    const auto found = odometry_.find(frame);
    return found == odometry_.end() ? std::nullopt : std::optional(found->second);
  }

  /// `counted`: with frames as the detector counts them.
  void add(const MapLoop& counted, std::vector<MapLoop>& found) {
    const MapLoop loop = in_session(counted);
    const bool is_earlier = counted.match.session != session_;
    if (rejected_.contain(loop)) {
      detector_.reject({0, counted.query.frame},
                       {is_earlier ? counted.match.session : 0, counted.match.frame});
    } else if (is_earlier && !known_.contain(loop)) {
      found.push_back(loop);
    }
  }

  /// With the number that the frame has in its session.
  [[nodiscard]] MapLoop in_session(MapLoop loop) const {
    loop.query.frame = frames_[static_cast<std::size_t>(loop.query.frame)];
    return loop;
  }

  /// Frames without a place were unreadable, or their places were dropped.
  void skip_to(std::int64_t frame) {
    map_->announce(nullptr);
    for (auto i = std::max(next_frame_, frame - kMaxSkipped); i < frame; ++i) {
      detector_.skip(std::nullopt, odometry_at(i));
      frames_.push_back(-1);
    }
    next_frame_ = frame + 1;
  }

  std::string path_;
  int session_;
  std::shared_ptr<MapBefore> map_;
  OdometryByFrame odometry_;
  FeatureReader reader_;
  FramePairs known_;
  FramePairs rejected_;
  LoopDetector detector_;
  std::vector<int> frames_;  ///< in the session, by the number that the detector gives them
  std::int64_t next_frame_ = 0;
};

/// The loops of a session that the map does not have. `progress(loops)` is called for each place
/// with how many there are so far; if it returns false, there is no answer.
template <typename Progress>
std::optional<std::vector<MapLoop>> new_loops_of(const MapSession& session, const std::string& path,
                                                 const LoopDetectorOptions& options,
                                                 const Progress& progress) {
  const auto database = open_map(path, MapDatabase::Access::read);
  Relived relived(database->path(), *database, session.session, options);
  Damage damage;
  const std::vector<MapPlace> places = places_of(*database, session.session, damage);
  refuse_damaged(database->path(), damage.clauses());
  std::vector<MapLoop> found;
  for (const MapPlace& place : places) {
    relived.process(place, found);
    if (!progress(found.size())) return std::nullopt;
  }
  return found;
}

/// Those it was recorded with. Another version may mean something else by them, except for those
/// that determine places.
LoopDetectorOptions options_of(const std::string& path, const MapSession& session) {
  if (session.loopbit != kVersion) return options_of_shape(path, session.options);
  return options_from_json(session.options, fmt::format("'{}'", path));
}

void write_link(const MapDatabase& database, int session, const std::vector<MapLoop>& loops) {
  const auto transaction = database.begin();
  RowWriter rows(database);
  for (const MapLoop& loop : loops) rows.write(loop);
  rows.write_linked(session);
  transaction->end();
}

/// The sessions that are not linked.
std::vector<MapSession> unlinked_sessions(const MapDatabase& database,
                                          const std::optional<LoopDetectorOptions>& options) {
  Damage damage;
  std::vector<MapSession> sessions = read_sessions(database, damage);
  refuse_damaged(database.path(), damage.clauses());
  if (options) {
    validate(*options);
    for (const MapSession& session : sessions)
      check_same_shape(database.path(), session.options, *options);
  }
  std::erase_if(sessions, [](const MapSession& session) { return session.linked; });
  return sessions;
}

std::int64_t num_places(const MapDatabase& database, const std::vector<MapSession>& sessions) {
  std::int64_t number = 0;
  const auto count = database.prepare("SELECT count(*) FROM place WHERE session = ?1");
  for (const MapSession& session : sessions) {
    count->bind(1, std::int64_t{session.session});
    if (count->step()) number += count->integer(0);
    count->reset();
  }
  return number;
}

LinkCounts link(const std::string& path, const MapDatabase& database,
                const std::optional<LoopDetectorOptions>& options,
                const std::function<bool(const LinkCounts&)>& progress) {
  const std::vector<MapSession> sessions = unlinked_sessions(database, options);
  LinkCounts counts;
  counts.total_places = num_places(database, sessions);
  for (const MapSession& session : sessions) {
    const LinkCounts before = counts;
    const auto advance = [&](std::size_t loops) {
      ++counts.places;
      counts.loops = before.loops + static_cast<std::int64_t>(loops);
      return !progress || progress(counts);
    };
    const auto loops = new_loops_of(
        session, path, options ? *options : options_of(database.path(), session), advance);
    if (!loops) return before;
    write_link(database, session.session, *loops);
    ++counts.sessions;
  }
  return counts;
}

/// Throws Error (kind input) if sessions, loops or what belongs to them are damaged.
void refuse_damaged_loops(const std::string& path, const MapDatabase& database) {
  Damage damage;
  (void)read_sessions(database, damage);
  (void)read_loops(database, damage);
  (void)read_rejected_loops(database, damage);
  (void)read_odometry(database, damage);
  (void)read_loop_poses(database, damage);
  refuse_damaged(path, damage.clauses());
}

/// Calls `write(database)` with the existing map at `path`, and closes it.
template <typename Write>
void write_map(const std::string& path, const Write& write) {
  (void)open_map(path, MapDatabase::Access::read);  // it must exist
  const auto database = open_map(path, MapDatabase::Access::link);
  try {
    write(*database);
  } catch (...) {
    database->close();
    throw;
  }
  database->close();
}

}  // namespace

LinkCounts link_map(const std::string& path, const std::optional<LoopDetectorOptions>& options,
                    const std::function<bool(const LinkCounts&)>& progress) {
  LinkCounts counts;
  write_map(path,
            [&](const MapDatabase& database) { counts = link(path, database, options, progress); });
  return counts;
}

void reject_loops(const std::string& path, const std::vector<MapLoop>& loops) {
  if (loops.empty()) return;
  write_map(path, [&](const MapDatabase& database) {
    refuse_damaged_loops(path, database);
    const auto transaction = database.begin();
    for (const MapLoop& loop : loops) reject_loop(database, loop.query, loop.match);
    transaction->end();
  });
}

}  // namespace loopbit
