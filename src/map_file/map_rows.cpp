// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "map_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"

#include "map_schema.hpp"
#include "row_values.hpp"

namespace loopbit {
namespace {

/// After an unreadable page, this many keys are tried to find the next readable one: ten in
/// sequence, then in steps that grow to 100, over 51,000 keys in all. A leaf page of contents has
/// 29 rows, and a page above it leads to about 50,000.
constexpr std::int64_t kMaxProbes = 1000;
constexpr std::int64_t kProbesPerStep = 10;

/// Calls visit(row, key) for each row of `table` that can be read, in order of its key, which is
/// the first of `columns`.
template <typename Visit>
void for_each_row(const MapDatabase& database, const std::string& table, const std::string& columns,
                  Damage& damage, const Visit& visit, const KeyRange& keys = {}) {
  const std::string key = columns.substr(0, columns.find(','));
  const auto statement = database.prepare(
      fmt::format("SELECT {0} FROM {1} WHERE {2} >= ?1 AND {2} <= ?3 ORDER BY {2} LIMIT ?2",
                  columns, table, key));
  SqlStatement& rows = *statement;
  const auto snapshot = database.snapshot();
  const std::int64_t at_once = database.rows_at_once();
  std::int64_t next = keys.first;
  std::int64_t damaged_from = 0;  // 0: not in a damaged range
  for (std::int64_t probes = 0; probes < kMaxProbes;) {
    rows.reset();
    rows.bind(1, next);
    rows.bind(2, at_once);
    rows.bind(3, keys.last);
    std::int64_t number = 0;
    SqlStatement::Step step = rows.step_if_readable();
    for (; step == SqlStatement::Step::row; step = rows.step_if_readable()) {
      const std::int64_t at = rows.integer(0);
      if (at < next || at == std::numeric_limits<std::int64_t>::max()) break;  // out of order
      if (damaged_from > 0) {
        damage.add(fmt::format("{} {} to {}: a page of the file cannot be read", table,
                               damaged_from, at - 1));
        damaged_from = 0;
      }
      visit(rows, at);
      next = at + 1;
      ++number;
    }
    if (step == SqlStatement::Step::end) {
      if (number == at_once) continue;  // there may be more
      if (damaged_from == 0) return;
      break;
    }
    if (damaged_from == 0) damaged_from = next;
    next += 1 + probes / kProbesPerStep;
    ++probes;
  }
  damage.add(fmt::format("{} {} and after: the file cannot be read", table, damaged_from));
}

bool has_checksum(const SqlStatement& row, int column, std::int64_t checksum) {
  return row.integer(column) == checksum;
}

/// -1 for values that do not fit: we never write these, and the checksum will differ.
int narrow(std::int64_t value) {
  return value >= 0 && value <= std::numeric_limits<int>::max() ? static_cast<int>(value) : -1;
}

SessionFrame session_frame(const SqlStatement& row, int column) {
  return {narrow(row.integer(column)), narrow(row.integer(column + 1))};
}

/// To two parameters, from `parameter` on.
void bind_frame(SqlStatement& row, int parameter, const SessionFrame& at) {
  row.bind(parameter, std::int64_t{at.session});
  row.bind(parameter + 1, std::int64_t{at.frame});
}

/// The columns of `loop` or `rejected` that loop_in() reads.
std::string loop_columns(const std::string& table) {
  return table +
         ", session, frame, match_session, match_frame, score, similarity, matches, inliers, "
         "checksum";
}

using LoopChecksum = std::int64_t (*)(const MapLoop&);

/// None, with a clause in `damage`, if it is damaged.
std::optional<MapLoop> loop_in(const SqlStatement& row, const std::string& table, std::int64_t key,
                               LoopChecksum checksum, Damage& damage) {
  const MapLoop loop{.query = session_frame(row, 1),
                     .match = session_frame(row, 3),
                     .score = row.real(5),
                     .similarity = row.real(6),
                     .matches = narrow(row.integer(7)),
                     .inliers = narrow(row.integer(8))};
  const bool is_finite = std::isfinite(loop.score) && std::isfinite(loop.similarity);
  if (is_finite && has_checksum(row, 9, checksum(loop))) return loop;
  damage.add(fmt::format("{} {}: its values differ from their checksum", table, key));
  return std::nullopt;
}

/// The rows of `loop` or `rejected`.
std::vector<MapLoop> read_loops_of(const MapDatabase& database, const std::string& table,
                                   LoopChecksum checksum, Damage& damage, const KeyRange& keys) {
  std::vector<MapLoop> loops;
  for_each_row(
      database, table, loop_columns(table), damage,
      [&](const SqlStatement& row, std::int64_t key) {
        const auto loop = loop_in(row, table, key, checksum, damage);
        if (loop) loops.push_back(*loop);
      },
      keys);
  return loops;
}

constexpr const char* kPlaceColumns = "place, session, frame, timestamp, content, checksum";

/// Of kPlaceColumns. False, with a clause in `damage`, if it is damaged.
bool read_place(const SqlStatement& row, std::int64_t key, MapPlace& place, Damage& damage) {
  place.id = key;
  place.at = session_frame(row, 1);
  place.timestamp_s.reset();
  if (!row.is_null(3)) place.timestamp_s = row.real(3);
  const bool is_finite = std::isfinite(place.timestamp_s.value_or(0.0));
  if (is_finite && read_content(row.bytes(4), place.content) &&
      has_checksum(row, 5, checksum_of(place))) {
    return true;
  }
  damage.add(fmt::format("place {}: its content differs from its checksum", key));
  return false;
}

/// Calls visit(row, key) for each row of these commits. The key is the first of `columns`.
template <typename Visit>
void for_each_new_row(const MapDatabase& database, const std::string& table,
                      const std::string& columns, const EpochRange& epochs, const Visit& visit) {
  const auto row = database.prepare(
      fmt::format("SELECT {0} FROM {1} JOIN batch USING (batch) WHERE epoch > ?1 AND epoch <= ?2 "
                  "ORDER BY epoch, {1}",
                  columns, table));
  row->bind(1, epochs.after);
  row->bind(2, epochs.last);
  while (row->step()) visit(*row, row->integer(0));
}

/// `table`: loop or rejected.
std::string insertion_of_loop(const std::string& table) {
  return fmt::format(
      "INSERT INTO {} (session, frame, match_session, match_frame, score, similarity, matches, "
      "inliers, checksum) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
      table);
}

void write_loop(SqlStatement& row, const MapLoop& loop, std::int64_t checksum) {
  bind_frame(row, 1, loop.query);
  bind_frame(row, 3, loop.match);
  row.bind(5, loop.score);
  row.bind(6, loop.similarity);
  row.bind(7, std::int64_t{loop.matches});
  row.bind(8, std::int64_t{loop.inliers});
  row.bind(9, checksum);
  row.run();
}

void mark_linked(const MapDatabase& database, std::vector<MapSession>& sessions, Damage& damage) {
  if (sessions.empty()) return;
  sessions.front().linked = true;  // to none
  if (!has_links(database)) return;
  for_each_row(database, "linked", "session, checksum", damage,
               [&](const SqlStatement& row, std::int64_t key) {
                 if (!has_checksum(row, 1, checksum_of_linked(narrow(key)))) {
                   damage.add(fmt::format("linked {}: its value differs from its checksum", key));
                   return;
                 }
                 for (MapSession& session : sessions) {
                   session.linked = session.linked || session.session == key;
                 }
               });
}

}  // namespace

KeyRange places_of(const MapDatabase& database, int session) {
  return {.first = database.place_key({session, 0}, 0),
          .last = database.place_key({session, std::numeric_limits<int>::max()}, 0)};
}

void refuse_damaged(const std::string& path, const std::vector<std::string>& clauses) {
  if (clauses.empty()) return;
  const std::size_t more = clauses.size() - 1;
  throw Error(
      ErrorKind::input,
      fmt::format("'{0}' is damaged ({1}{2}), and is left as it is; 'loopbit map check {0} "
                  "--recover NEW.db' saves the rest in a new map.",
                  path, clauses.front(), more > 0 ? fmt::format(", and {} more", more) : ""));
}

Error unknown_session(const std::string& path, int session) {
  return {ErrorKind::option,
          fmt::format("'{0}' has no session {1}; 'loopbit map list {0}' shows those there are.",
                      path, session)};
}

std::vector<MapSession> read_sessions(const MapDatabase& database, Damage& damage,
                                      const KeyRange& keys) {
  std::vector<MapSession> sessions;
  for_each_row(
      database, "session", "session, uid, name, started, loopbit, options, frames, checksum",
      damage,
      [&](const SqlStatement& row, std::int64_t key) {
        MapSession session{.session = narrow(key),
                           .uid = row.text(1),
                           .name = row.text(2),
                           .started = row.text(3),
                           .loopbit = row.text(4),
                           .options = row.text(5),
                           .frames = row.integer(6)};
        if (has_checksum(row, 7, checksum_of(session))) {
          sessions.push_back(std::move(session));
        } else {
          damage.add(fmt::format("session {}: its description differs from its checksum", key));
        }
      },
      keys);
  mark_linked(database, sessions, damage);
  return sessions;
}

void for_each_place(const MapDatabase& database, const std::function<void(const MapPlace&)>& visit,
                    Damage& damage, const KeyRange& keys) {
  MapPlace place;
  for_each_row(
      database, "place", kPlaceColumns, damage,
      [&](const SqlStatement& row, std::int64_t key) {
        if (read_place(row, key, place, damage)) visit(place);
      },
      keys);
}

void for_each_new_place(const MapDatabase& database, const EpochRange& epochs,
                        const std::function<void(const MapPlace&)>& visit, Damage& damage) {
  MapPlace place;
  for_each_new_row(database, "place", kPlaceColumns, epochs,
                   [&](const SqlStatement& row, std::int64_t key) {
                     if (read_place(row, key, place, damage)) visit(place);
                   });
}

std::unordered_set<std::int64_t> new_places(const MapDatabase& database, const EpochRange& epochs) {
  std::unordered_set<std::int64_t> places;
  for_each_new_row(database, "place", "place", epochs,
                   [&](const SqlStatement& /*row*/, std::int64_t key) { places.insert(key); });
  return places;
}

std::vector<MapLoop> read_new_loops(const MapDatabase& database, const std::string& table,
                                    const EpochRange& epochs, Damage& damage) {
  LoopChecksum checksum = checksum_of_rejected;
  if (table == "loop") checksum = [](const MapLoop& loop) { return checksum_of(loop); };
  std::vector<MapLoop> loops;
  for_each_new_row(database, table, loop_columns(table), epochs,
                   [&](const SqlStatement& row, std::int64_t key) {
                     const auto loop = loop_in(row, table, key, checksum, damage);
                     if (loop) loops.push_back(*loop);
                   });
  return loops;
}

std::vector<MapLoop> read_loops(const MapDatabase& database, Damage& damage, const KeyRange& keys) {
  return read_loops_of(
      database, "loop", [](const MapLoop& loop) { return checksum_of(loop); }, damage, keys);
}

std::vector<MapLoop> read_rejected_loops(const MapDatabase& database, Damage& damage,
                                         const KeyRange& keys) {
  if (!has_links(database)) return {};
  return read_loops_of(database, "rejected", checksum_of_rejected, damage, keys);
}

std::vector<MapOdometry> read_odometry(const MapDatabase& database, Damage& damage,
                                       const KeyRange& keys) {
  std::vector<MapOdometry> all;
  if (!has_odometry(database)) return all;
  for_each_row(
      database, "odometry", "odometry, session, frame, timestamp, pose, checksum", damage,
      [&](const SqlStatement& row, std::int64_t key) {
        MapOdometry odometry{.at = session_frame(row, 1)};
        if (!row.is_null(3)) odometry.timestamp_s = row.real(3);
        if (const auto motion = motion_from(row.bytes(4))) {
          odometry.pose = {motion->T_from_to, motion->covariance};
        }
        if (odometry.pose.covariance && is_valid(odometry.pose) &&
            has_checksum(row, 5, checksum_of(odometry, row.bytes(4)))) {
          all.push_back(odometry);
        } else {
          damage.add(fmt::format("odometry {}: its values differ from their checksum", key));
        }
      },
      keys);
  const auto place = [](const MapOdometry& one) { return std::pair(one.at.session, one.at.frame); };
  std::ranges::stable_sort(all, {}, place);
  return all;
}

std::vector<MapLoopPose> read_loop_poses(const MapDatabase& database, Damage& damage,
                                         const KeyRange& keys) {
  std::vector<MapLoopPose> poses;
  if (!has_odometry(database)) return poses;
  for_each_row(
      database, "relative_pose",
      "relative_pose, session, frame, match_session, match_frame, known, pose, checksum", damage,
      [&](const SqlStatement& row, std::int64_t key) {
        MapLoopPose pose{.query = session_frame(row, 1), .match = session_frame(row, 3)};
        const auto motion = motion_from(row.bytes(6));
        const auto* const known = std::ranges::find(kAllPoseKnown, row.text(5),
                                                    [](PoseKnown each) { return to_string(each); });
        const bool is_pose = motion && known != kAllPoseKnown.end() &&
                             is_valid({motion->T_from_to}) && cv::checkRange(motion->covariance);
        if (is_pose) pose.measured = {*known, *motion};
        if (is_pose && has_checksum(row, 7, checksum_of(pose, row.bytes(6)))) {
          poses.push_back(pose);
        } else {
          damage.add(fmt::format("relative_pose {}: its values differ from their checksum", key));
        }
      },
      keys);
  return poses;
}

std::map<int, KnownRows> known_rows(const MapDatabase& database, std::optional<int> session) {
  std::map<int, KnownRows> known;
  const auto each = [&](const std::string& columns_and_table, const auto& visit) {
    const auto row = database.prepare(fmt::format("SELECT session, {}{}", columns_and_table,
                                                  session ? " WHERE session = ?1" : ""));
    if (session) row->bind(1, std::int64_t{*session});
    while (row->step()) visit(known[narrow(row->integer(0))], *row);
  };
  each("frames FROM session",
       [](KnownRows& of, const SqlStatement& row) { of.frames = row.integer(1); });
  const auto pairs = [&](const std::string& table, std::set<KnownRows::Pair> KnownRows::*set) {
    each("frame, match_session, match_frame FROM " + table,
         [&](KnownRows& of, const SqlStatement& row) {
           (of.*set).insert({row.integer(1), row.integer(2), row.integer(3)});
         });
  };
  pairs("loop", &KnownRows::loops);
  if (has_links(database)) pairs("rejected", &KnownRows::rejected);
  if (has_odometry(database)) pairs("relative_pose", &KnownRows::poses);
  return known;
}

MapLoop loop_of(const Detection& detection, int session) {
  return {
      .query = {session, detection.frame},
      .match = detection.earlier_match.value_or(SessionFrame{session, detection.match.value_or(0)}),
      .score = detection.score,
      .similarity = detection.similarity,
      .matches = detection.matches,
      .inliers = detection.inliers};
}

MapLoop loop_of(const LateLoop& loop, int session) {
  return {.query = {session, loop.frame},
          .match = loop.earlier_match.value_or(SessionFrame{session, loop.match.value_or(0)}),
          .score = loop.score,
          .similarity = loop.similarity};
}

namespace {

/// Those in a column, whose checksum is in the next one; none if they are damaged.
std::optional<Features> checked_features(const SqlStatement& row, int column,
                                         const SessionFrame& at) {
  const auto bytes = row.bytes(column);
  if (!has_checksum(row, column + 1, checksum_of_features(bytes, at))) return std::nullopt;
  return features_from(bytes);
}

}  // namespace

FeatureReader::FeatureReader(const MapDatabase& database)
    : row_(database.prepare("SELECT features, checksum FROM features WHERE place = ?1")) {}

std::optional<Features> FeatureReader::read(std::int64_t place, const SessionFrame& at,
                                            Damage& damage) {
  row_->reset();
  row_->bind(1, place);
  std::optional<Features> features;
  if (row_->step_if_readable() == SqlStatement::Step::row) {
    features = checked_features(*row_, 0, at);
  }
  row_->reset();  // ends the read, so that the log can be emptied
  if (!features) {
    damage.add(
        fmt::format("place {} (session {}, frame {}): its features are missing or "
                    "differ from their checksum",
                    place, at.session, at.frame));
  }
  return features;
}

void for_each_features(const MapDatabase& database, const KeyRange& keys,
                       const std::function<void(std::int64_t, Features)>& visit) {
  const auto row = database.prepare(
      "SELECT place, session, frame, features, features.checksum FROM features JOIN place USING "
      "(place) WHERE place >= ?1 AND place <= ?2");
  row->bind(1, keys.first);
  row->bind(2, keys.last);
  while (row->step()) {
    auto features = checked_features(*row, 3, session_frame(*row, 1));
    if (features) visit(row->integer(0), std::move(*features));
  }
}

void for_each_image(const MapDatabase& database,
                    const std::function<void(std::int64_t, std::int64_t)>& visit, Damage& damage) {
  if (!has_images(database)) return;
  for_each_row(database, "image", "place, length(image)", damage,
               [&](const SqlStatement& row, std::int64_t place) { visit(place, row.integer(1)); });
}

ImageReader::ImageReader(const MapDatabase& database) {
  if (!has_images(database)) return;
  row_ = database.prepare("SELECT image, checksum FROM image WHERE place = ?1");
}

std::optional<std::vector<unsigned char>> ImageReader::read(std::int64_t place,
                                                            const SessionFrame& at,
                                                            Damage& damage) {
  if (!row_) return std::nullopt;
  row_->reset();
  row_->bind(1, place);
  const SqlStatement::Step step = row_->step_if_readable();
  std::optional<std::vector<unsigned char>> image;
  if (step == SqlStatement::Step::row) {
    const auto bytes = row_->bytes(0);
    if (has_checksum(*row_, 1, checksum_of_image(bytes, at))) {
      image.emplace(bytes.begin(), bytes.end());
    }
  }
  row_->reset();  // ends the read, so that the log can be emptied
  if (!image && step != SqlStatement::Step::end) {
    damage.add(fmt::format("place {} (session {}, frame {}): its image differs from its checksum",
                           place, at.session, at.frame));
  }
  return image;
}

RowWriter::RowWriter(const MapDatabase& database)
    : session_(database.prepare(
          "INSERT INTO session (session, uid, name, started, loopbit, options, frames, checksum) "
          "VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8) ON CONFLICT (session) DO UPDATE SET frames = "
          "?7, checksum = ?8")),
      linked_(database.prepare("INSERT INTO linked (session, checksum) VALUES (?1, ?2) ON CONFLICT "
                               "(session) DO UPDATE SET checksum = ?2")),
      place_(database.prepare("INSERT INTO place (place, session, frame, timestamp, content, "
                              "checksum) VALUES (?1, ?2, ?3, ?4, ?5, ?6)")),
      features_(
          database.prepare("INSERT INTO features (place, features, checksum) VALUES (?1, ?2, ?3)")),
      image_(database.prepare("INSERT INTO image (place, image, checksum) VALUES (?1, ?2, ?3)")),
      loop_(database.prepare(insertion_of_loop("loop"))),
      rejected_(database.prepare(insertion_of_loop("rejected"))),
      odometry_(database.prepare("INSERT INTO odometry (session, frame, timestamp, pose, checksum) "
                                 "VALUES (?1, ?2, ?3, ?4, ?5)")),
      relative_pose_(database.prepare(
          "INSERT INTO relative_pose (session, frame, match_session, match_frame, known, pose, "
          "checksum) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")) {}

void RowWriter::write(const MapSession& session) {
  session_->bind(1, std::int64_t{session.session});
  session_->bind(2, std::string_view(session.uid));
  session_->bind(3, std::string_view(session.name));
  session_->bind(4, std::string_view(session.started));
  session_->bind(5, std::string_view(session.loopbit));
  session_->bind(6, std::string_view(session.options));
  session_->bind(7, session.frames);
  session_->bind(8, checksum_of(session));
  session_->run();
}

void RowWriter::write(const MapPlace& place, const Features& features) {
  place_->bind(1, place.id);
  bind_frame(*place_, 2, place.at);
  place.timestamp_s ? place_->bind(4, *place.timestamp_s) : place_->bind_null(4);
  place_->bind(5, content_bytes(place.content));
  place_->bind(6, checksum_of(place));
  place_->run();
  const std::vector<unsigned char> bytes = features_bytes(features);
  features_->bind(1, place.id);
  features_->bind(2, bytes);
  features_->bind(3, checksum_of_features(bytes, place.at));
  features_->run();
}

void RowWriter::write_image(const MapPlace& place, std::span<const unsigned char> jpeg) {
  if (jpeg.empty()) return;
  image_->bind(1, place.id);
  image_->bind(2, jpeg);
  image_->bind(3, checksum_of_image(jpeg, place.at));
  image_->run();
}

void RowWriter::write(const MapLoop& loop) { write_loop(*loop_, loop, checksum_of(loop)); }

void RowWriter::write_rejected(const MapLoop& loop) {
  write_loop(*rejected_, loop, checksum_of_rejected(loop));
}

void RowWriter::write(const MapOdometry& odometry) {
  const PoseNumbers numbers =
      pose_numbers(odometry.pose.T_odometry_camera, odometry.pose.covariance.value());
  bind_frame(*odometry_, 1, odometry.at);
  odometry.timestamp_s ? odometry_->bind(3, *odometry.timestamp_s) : odometry_->bind_null(3);
  odometry_->bind(4, bytes_of(numbers));
  odometry_->bind(5, checksum_of(odometry, bytes_of(numbers)));
  odometry_->run();
}

void RowWriter::write(const MapLoopPose& pose) {
  const Motion& motion = pose.measured.motion;
  const PoseNumbers numbers = pose_numbers(motion.T_from_to, motion.covariance);
  bind_frame(*relative_pose_, 1, pose.query);
  bind_frame(*relative_pose_, 3, pose.match);
  relative_pose_->bind(5, to_string(pose.measured.known));
  relative_pose_->bind(6, bytes_of(numbers));
  relative_pose_->bind(7, checksum_of(pose, bytes_of(numbers)));
  relative_pose_->run();
}

void RowWriter::write_linked(int session) {
  linked_->bind(1, std::int64_t{session});
  linked_->bind(2, checksum_of_linked(session));
  linked_->run();
}

void remove_place(const MapDatabase& database, std::int64_t place) {
  for (const char* table : {"features", "image", "place"}) {
    const auto row = database.prepare(fmt::format("DELETE FROM {} WHERE place = ?1", table));
    row->bind(1, place);
    row->run();
  }
  const auto left = database.prepare("SELECT session FROM place WHERE place = ?1");
  left->bind(1, place);
  if (!left->step()) return;
  throw Error(
      ErrorKind::output,
      fmt::format("'{}' does not let this user remove a place of session {}: only its owner "
                  "may.",
                  database.path(), left->integer(0)));
}

void reject_loop(const MapDatabase& database, const SessionFrame& query,
                 const SessionFrame& match) {
  reject_loop(database, MapLoop{.query = query, .match = match});
}

void reject_loop(const MapDatabase& database, MapLoop loop) {
  const auto of_pair = [&](const std::string& what) {
    auto statement = database.prepare(
        what + " WHERE session = ?1 AND frame = ?2 AND match_session = ?3 AND match_frame = ?4");
    bind_frame(*statement, 1, loop.query);
    bind_frame(*statement, 3, loop.match);
    return statement;
  };
  if (!of_pair("SELECT rejected FROM rejected")->step()) {
    const auto found = of_pair("SELECT score, similarity, matches, inliers FROM loop");
    if (found->step()) {
      loop.score = found->real(0);
      loop.similarity = found->real(1);
      loop.matches = narrow(found->integer(2));
      loop.inliers = narrow(found->integer(3));
    }
    found->reset();
    RowWriter(database).write_rejected(loop);
  }
  of_pair("DELETE FROM loop")->step();
}

}  // namespace loopbit
