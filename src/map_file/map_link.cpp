// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstddef>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/loop_detector.hpp"
#include "loopbit/map_tools.hpp"
#include "loopbit/version.hpp"

#include "map_log.hpp"
#include "map_options.hpp"
#include "map_rows.hpp"
#include "map_schema.hpp"
#include "stored_features.hpp"

namespace loopbit {
namespace {

/// A map as it was for the detector of one of its sessions, whose frames are processed again.
class MapBefore : public MapStorage {
 public:
  MapBefore(std::string path, const Database& database, int session)
      : path_(std::move(path)),
        database_(database),
        session_(session),
        reader_(database),
        stored_(database, kMapCache_mb) {}

  void check_options(const LoopDetectorOptions& /*options*/) override {}  // link_map() does

  /// Keeps the places of the session for later.
  void for_each_earlier_place(const Visit& visit) override {
    stored_.begin(path_);
    for_each_place(
        database_,
        [&](const MapPlace& place) {
          if (place.at.session == session_) own_.push_back(place);
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
    return stored_.get(place, damage_);
  }

  void add(const Detection& detection, const BinaryContent& /*content*/,
           std::shared_ptr<const Features> features, const cv::Mat& /*image*/) override {
    const MapPlace* place = own_place(detection.frame);
    const PlaceId number = stored_.size();
    stored_.add(place ? place->id : StoredFeatures::kNoRow, {session_, detection.frame});
    stored_.keep(number, std::move(features));
  }

  void remove(PlaceId /*place*/) override {}                                             // unused
  void reject(const SessionFrame& /*query*/, const SessionFrame& /*match*/) override {}  // known

  /// The place of a frame of the session; null if it has none.
  [[nodiscard]] const MapPlace* own_place(int frame) const {
    const auto found =
        std::lower_bound(own_.begin(), own_.end(), frame,
                         [](const MapPlace& place, int number) { return place.at.frame < number; });
    return found != own_.end() && found->at.frame == frame ? &*found : nullptr;
  }

  /// The features that the map has of it.
  [[nodiscard]] std::optional<Features> stored_features(const MapPlace& place) {
    return reader_.read(place.id, place.at, damage_);
  }

  [[nodiscard]] Damage& damage() { return damage_; }

 private:
  std::string path_;
  const Database& database_;
  int session_;
  FeatureReader reader_;
  StoredFeatures stored_;
  std::vector<MapPlace> own_;
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

/// Processes the frames of a session again. `progress(is_new_loop)` is called for each; if it
/// returns false, there is no answer.
template <typename Progress>
std::optional<std::vector<MapLoop>> new_loops_of(const MapSession& session, const std::string& path,
                                                 const LoopDetectorOptions& options,
                                                 const Progress& progress) {
  const Database database = open_map_for_reading(path);
  const auto before = std::make_shared<MapBefore>(path, database, session.session);
  const FramePairs known(read_loops(database, before->damage()), session.session);
  const FramePairs rejected(read_rejected_loops(database, before->damage()), session.session);
  LoopDetector detector(options, before);
  std::vector<MapLoop> found;
  while (detector.size() < session.frames) {
    const MapPlace* place = before->own_place(detector.size());
    auto features = place ? before->stored_features(*place) : std::nullopt;
    const Detection detection =
        features ? detector.process(place->content, std::move(*features), place->timestamp_s)
                 : detector.skip();
    refuse_damaged(path, before->damage().clauses());
    const MapLoop loop = loop_of(detection, session.session);
    const bool is_rejected = detection.status == Status::loop && rejected.contain(loop);
    if (is_rejected) detector.reject(detection);
    const bool is_new = detection.status == Status::loop && detection.earlier_match &&
                        !is_rejected && !known.contain(loop);
    if (is_new) found.push_back(loop);
    if (!progress(is_new)) return std::nullopt;
  }
  return found;
}

/// Those it was recorded with. Another version may mean something else by them, except for those
/// that determine places.
LoopDetectorOptions options_of(const std::string& path, const MapSession& session) {
  if (session.loopbit != kVersion) return options_of_shape(path, session.options);
  return options_from_json(session.options, fmt::format("'{}'", path));
}

void write_link(const Database& database, int session, const std::vector<MapLoop>& loops) {
  Commit commit(database);
  RowWriter rows(database);
  for (const MapLoop& loop : loops) rows.write(loop);
  rows.write_linked(session);
  commit.end();
}

/// The sessions that are not linked.
std::vector<MapSession> unlinked_sessions(const std::string& path, const Database& database,
                                          const std::optional<LoopDetectorOptions>& options) {
  Damage damage;
  std::vector<MapSession> sessions = read_sessions(database, damage);
  refuse_damaged(path, damage.clauses());
  if (options) {
    validate(*options);
    for (const MapSession& session : sessions) check_same_shape(path, session.options, *options);
  }
  std::erase_if(sessions, [](const MapSession& session) { return session.linked; });
  return sessions;
}

LinkCounts link(const std::string& path, const Database& database,
                const std::optional<LoopDetectorOptions>& options,
                const std::function<bool(const LinkCounts&)>& progress) {
  const std::vector<MapSession> sessions = unlinked_sessions(path, database, options);
  LinkCounts counts;
  for (const MapSession& session : sessions) counts.total_frames += session.frames;
  for (const MapSession& session : sessions) {
    const LinkCounts before = counts;
    const auto advance = [&](bool is_new) {
      ++counts.frames;
      counts.loops += is_new;
      return !progress || progress(counts);
    };
    const auto loops =
        new_loops_of(session, path, options ? *options : options_of(path, session), advance);
    if (!loops) return before;
    write_link(database, session.session, *loops);
    ++counts.sessions;
  }
  return counts;
}

}  // namespace

LinkCounts link_map(const std::string& path, const std::optional<LoopDetectorOptions>& options,
                    const std::function<bool(const LinkCounts&)>& progress) {
  (void)open_map_for_reading(path);  // it must exist
  const Database database = open_map_for_writing(path);
  try {
    const LinkCounts counts = link(path, database, options, progress);
    close_log(database);
    return counts;
  } catch (...) {
    close_log(database);
    throw;
  }
}

}  // namespace loopbit
