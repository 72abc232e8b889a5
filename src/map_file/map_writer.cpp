// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <iterator>
#include <new>
#include <random>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include "loopbit/database.hpp"
#include "loopbit/error.hpp"
#include "loopbit/map_file.hpp"
#include "loopbit/map_server.hpp"
#include "loopbit/picture.hpp"
#include "loopbit/version.hpp"

#include "batch_writer.hpp"
#include "earlier_sessions.hpp"
#include "file_database.hpp"
#include "map_options.hpp"
#include "map_rows.hpp"
#include "session_upload.hpp"
#include "stored_features.hpp"

namespace loopbit {
namespace {

/// 128 random bits in hexadecimal.
std::string new_uid() {
  std::random_device random;
  std::string uid;
  for (int i = 0; i < 4; ++i) uid += fmt::format("{:08x}", random());
  return uid;
}

/// Of a path that nothing has: "queue_2.db" if there is a "queue.db".
std::string free_path(const std::string& path) {
  const std::filesystem::path wanted(path);
  std::error_code error;
  std::string free = path;
  for (int number = 2; std::filesystem::exists(free, error); ++number) {
    free = (wanted.parent_path() /
            fmt::format("{}_{}{}", wanted.stem().string(), number, wanted.extension().string()))
               .string();
  }
  return free;
}

/// Frames that are queued for a server should be there, and seen by other robots, within a second.
constexpr std::chrono::milliseconds kMaxQueued{250};

std::string now_utc() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

}  // namespace

class MapWriter::Impl {
 public:
  Impl(const std::string& path, const LoopDetectorOptions& options, const std::string& name,
       EncodeImage encode_image, std::size_t cache_mb)
      : options_(options), encode_image_(std::move(encode_image)) {
    begin_session(path, name, cache_mb);
  }

  void finish(const std::function<bool()>& is_stopped = {}) {
    if (!stored_) return;
    if (writer_) writer_->flush();
    const bool is_whole = !upload_ || upload_->catch_up(is_stopped);
    keep_last();
    earlier_.reset();
    stored_.reset();
    own_features_.reset();
    own_file_.reset();
    server_.reset();
    if (writer_) writer_->close();
    if (!is_on_server_ || !is_whole) return;
    if (writer_) remove_database(queue_);
    queue_.clear();
  }

  void set_queue(const std::string& path) {
    if (is_on_server_ && !writer_) queue_ = free_path(path);
  }

  void flush() {
    if (!writer_) return;
    writer_->flush();
    if (!upload_ || upload_->catch_up()) return;
    throw upload_->fault().value();
  }

  /// Whether this is the copy in a forked child, which has no thread.
  [[nodiscard]] bool is_forked() const { return getpid() != process_; }

  /// Throws Error (kind option) in a forked child.
  void check_process() const {
    if (!is_forked()) return;
    throw Error(
        ErrorKind::option,
        fmt::format("The MapWriter of '{}' belongs to process {}, which forked this one. Use "
                    "it there, or fork before you open the map.",
                    path_, process_));
  }

  void check_options(const LoopDetectorOptions& options) {
    check_detector(path_, options_, options);
  }

  void for_each_earlier_place(const Visit& visit) {
    stored().begin(path_);
    earlier_->for_each_place([&](const MapPlace& place) {
      stored().add(place.id, place.at);
      visit(place.at, place.content);
    });
  }

  void for_each_earlier_loop(const VisitLoop& visit) {
    (void)stored();  // not after finish()
    for (const MapLoop& loop : earlier_->loops()) visit(loop.query, loop.match);
    earlier_->end_snapshots();
  }

  [[nodiscard]] std::int64_t epoch() const { return earlier_ ? earlier_->epoch() : 0; }

  MapNews news() {
    if (!earlier_) return {};
    MapFollower::News found = earlier_->news();
    if (writer_) {
      for (const MapSession& session : found.sessions) writer_->add_other(session);
    }
    MapNews news{.epoch = found.epoch};
    for (const MapPlace& place : found.places) {
      stored().add_new(place.id, place.at);
      news.places.push_back({place.at, place.content});
    }
    const auto take = [this](const std::vector<MapLoop>& loops, std::vector<MapNews::Loop>& to) {
      for (const MapLoop& loop : loops) {
        to.push_back({loop.query, loop.match});
        if (loop.match.session == session_) to.back().match.session = 0;
      }
    };
    take(found.loops, news.loops);
    take(found.rejected, news.rejected);
    return news;
  }

  std::shared_ptr<const Features> features(PlaceId place) {
    if (auto found = stored().find(place)) return found;
    if (writer_) {
      if (auto pending = writer_->pending(place - session_begin())) return pending;
    }
    if (is_on_server_ && place >= session_begin()) {
      return stored().get(place, queue_damage_, own_features());
    }
    const auto& [id, at] = stored().place(place);
    if (id == StoredFeatures::kNoRow) return std::make_shared<const Features>();
    std::shared_ptr<const Features> read = earlier_->features(id, at);
    if (!read) {
      ++unverified_;
      return std::make_shared<const Features>();
    }
    stored().keep(place, read);
    return read;
  }

  void add(const Detection& detection, const BinaryContent& content,
           std::shared_ptr<const Features> features, const cv::Mat& image) {
    StoredFeatures& places = stored();
    earlier_->end_snapshots();  // of a detector that did not ask for earlier loops
    places.reserve_next();
    earlier_->begin_frame();
    writer().add({.content = content,
                  .detection = detection,
                  .features = features,
                  .image = encode_image_ ? halved_to_picture(image) : cv::Mat()});
    // From here on nothing may fail, since the frame is in the map.
    const bool has_row = detection.status != Status::unreadable;
    const PlaceId place = places.size();
    places.add(has_row ? begun_.first_place + detection.frame : StoredFeatures::kNoRow,
               {session_, detection.frame});
    ++frames_;
    try {
      places.keep(place, std::move(features));
    } catch (const std::bad_alloc&) {
      // They are read from the map instead.
    }
  }

  void remove(PlaceId place) {
    refuse_elsewhere(stored().place(place).at.session);
    const std::int64_t id = stored().remove(place);
    if (id == StoredFeatures::kNoRow) return;
    change(place >= session_begin(),
           [id](const MapDatabase& database) { remove_place(database, id); });
  }

  void add_pose(MapLoopPose pose) {
    (void)stored();  // not after finish()
    if (pose.measured.known == PoseKnown::nothing) return;
    for (SessionFrame* at : {&pose.query, &pose.match}) {
      if (at->session == 0) at->session = session_;
    }
    writer().change([pose](const MapDatabase& database) { RowWriter(database).write(pose); });
  }

  void reject(SessionFrame query, SessionFrame match) {
    (void)stored();  // not after finish()
    for (SessionFrame* at : {&query, &match}) {
      if (at->session == 0) at->session = session_;
      if (at->session == session_ || earlier_->sessions().contains(at->session)) continue;
      throw unknown_session(path_, at->session);
    }
    const SessionUpload::Change rejection = [query, match](const MapDatabase& database) {
      reject_loop(database, query, match);
    };
    if (query.session == session_) {
      writer().change(rejection);  // the upload copies it
    } else {
      refuse_elsewhere(query.session);
      change(false, rejection);
    }
  }

  [[nodiscard]] int session() const { return session_; }

  [[nodiscard]] std::vector<std::string> damage() const {
    std::vector<std::string> all = earlier_ ? earlier_->damage() : last_.damage;
    all.insert(all.end(), queue_damage_.clauses().begin(), queue_damage_.clauses().end());
    return all;
  }

  [[nodiscard]] const std::string& queue() const { return queue_; }
  [[nodiscard]] std::int64_t unverified() const { return unverified_; }

  [[nodiscard]] std::int64_t saved_frames() const {
    if (is_on_server_) return upload_ ? upload_->saved_frames() : last_.saved_frames;
    return writer_->saved_frames();
  }

  [[nodiscard]] int reconnections() const {
    return upload_ ? upload_->reconnections() : last_.reconnections;
  }

  std::vector<std::string> take_notices() {
    std::vector<std::string> all = std::exchange(last_.notices, {});
    const auto add = [&](std::vector<std::string> more) {
      std::ranges::move(more, std::back_inserter(all));
    };
    if (earlier_) add(earlier_->take_notices());
    if (upload_) add(upload_->take_notices());
    return all;
  }

  [[nodiscard]] std::vector<std::string> not_asked() const {
    if (!earlier_) return last_.not_asked;
    return {earlier_->not_asked().begin(), earlier_->not_asked().end()};
  }

 private:
  void begin_session(const std::string& path, const std::string& name, std::size_t cache_mb) {
    const std::vector<std::string> paths = addresses_in(path);
    server_ = open_map(paths.front(), MapDatabase::Access::write);
    path_ = server_->path();
    is_on_server_ = is_map_address(path);
    const MapDatabase::NewSession begun = server_->begin_session();
    session_ = begun.session;
    earlier_.emplace(paths, session_, options_);
    stored_.emplace(cache_mb);
    begun_ = {.session = {.session = session_,
                          .uid = new_uid(),
                          .name = name,
                          .started = now_utc(),
                          .loopbit = kVersion,
                          .options = to_json(options_),
                          .linked = begun.is_linked},
              .first_place = server_->place_key({session_, 0}, 0),
              .earlier_frames = earlier_->first_frames()};
    if (is_on_server_) {
      queue_ = free_path(fmt::format("{}_session_{}_queue.db", map_stem(paths.front()), session_));
    } else {
      writer_ = std::make_unique<BatchWriter>(std::move(server_), begun_.session,
                                              begun_.first_place, options_.odometry, encode_image_);
    }
  }

  /// Of a map on a server, the file that queues its rows is made by the first call.
  BatchWriter& writer() {
    if (writer_) return *writer_;
    upload_ = std::make_unique<SessionUpload>(std::move(server_), begun_, queue_);
    MapSession queued = begun_.session;
    queued.linked = false;
    writer_ = std::make_unique<BatchWriter>(
        nullptr, std::move(queued), begun_.first_place, options_.odometry, encode_image_,
        BatchOptions{.max_delay = kMaxQueued,
                     .on_commit = [this] { upload_->wake(std::exchange(changes_, {})); },
                     .path = queue_});
    for (const auto& [number, session] : earlier_->sessions()) writer_->add_other(session);
    return *writer_;
  }

  /// Makes a change of the map and, if it is of this session, of what is queued for a server.
  void change(bool is_own, const SessionUpload::Change& change) {
    if (!is_on_server_) return writer().change(change);
    writer().change([this, is_own, change](const MapDatabase& queued) {
      if (is_own) change(queued);
      changes_.push_back(change);
    });
  }

  /// Throws Error (kind option) if a session is on a server that is only read.
  void refuse_elsewhere(int session) const {
    if (!earlier_->is_elsewhere(session)) return;
    throw Error(
        ErrorKind::option,
        fmt::format("Session {0} is on '{1}', which is only read, since '{2}' is named before "
                    "it; open '{1}' to change it.",
                    session, earlier_->server_of(session), path_));
  }

  /// Of frames of this session that are queued.
  FeatureReader& own_features() {
    if (!own_features_) {
      own_file_ = open_map(queue_, MapDatabase::Access::read);
      own_features_.emplace(*own_file_);
    }
    return *own_features_;
  }

  /// What is asked after finish(), too.
  struct Last {
    std::vector<std::string> notices = {};
    std::vector<std::string> damage = {};
    std::vector<std::string> not_asked = {};
    int reconnections = 0;
    std::int64_t saved_frames = 0;  ///< on a server
  };

  void keep_last() {
    last_ = {.notices = take_notices(), .damage = earlier_->damage(), .not_asked = not_asked()};
    if (!upload_) return;
    last_.reconnections = upload_->reconnections();
    last_.saved_frames = upload_->saved_frames();
    upload_.reset();
  }

  /// Throws Error (kind option) after finish().
  StoredFeatures& stored() {
    if (!stored_) {
      throw Error(ErrorKind::option,
                  fmt::format("Session {} of its map is finished: nothing can be added to it or "
                              "asked; open the map again.",
                              session_));
    }
    return *stored_;
  }

  [[nodiscard]] PlaceId session_begin() { return stored().size() - frames_; }

  pid_t process_ = getpid();
  std::string path_;             ///< for messages
  LoopDetectorOptions options_;  ///< of the session
  EncodeImage encode_image_;
  bool is_on_server_ = false;
  int session_ = 0;
  SessionUpload::Begun begun_;
  PlaceId frames_ = 0;                      ///< of this session
  std::unique_ptr<MapDatabase> server_;     ///< for writing; until something is written
  std::optional<EarlierSessions> earlier_;  ///< gone after finish(), as is stored_
  std::optional<StoredFeatures> stored_;
  std::int64_t unverified_ = 0;

  // Of a map on a server.
  std::string queue_;                      ///< the file; empty when the server has all of it
  std::unique_ptr<MapDatabase> own_file_;  ///< the same, for reading
  std::optional<FeatureReader> own_features_;
  Damage queue_damage_;
  std::vector<SessionUpload::Change> changes_;  ///< for the writer's thread
  std::unique_ptr<SessionUpload> upload_;

  Last last_;

  std::unique_ptr<BatchWriter> writer_;  ///< last: its thread uses the others
};

MapWriter::MapWriter(const std::string& path, const LoopDetectorOptions& options,
                     const std::string& name, EncodeImage encode_image, std::size_t cache_mb)
    : impl_(std::make_unique<Impl>(path, options, name, std::move(encode_image), cache_mb)) {}

MapWriter::~MapWriter() {
  if (impl_->is_forked()) {
    (void)impl_.release();  // its thread, locks and SQLite belong to the parent
    return;
  }
  try {
    impl_->finish();
  } catch (...) {  // callers who want the error call finish()
  }
}

MapWriter::Impl& MapWriter::impl() const {
  impl_->check_process();
  return *impl_;
}

void MapWriter::check_process() const { impl_->check_process(); }
int MapWriter::session() const { return impl().session(); }
std::int64_t MapWriter::saved_frames() const { return impl().saved_frames(); }
int MapWriter::reconnections() const { return impl().reconnections(); }
std::int64_t MapWriter::unverified() const { return impl().unverified(); }
const std::string& MapWriter::queue() const { return impl().queue(); }
void MapWriter::set_queue(const std::string& path) { impl().set_queue(path); }
std::vector<std::string> MapWriter::not_asked() const { return impl().not_asked(); }
std::vector<std::string> MapWriter::take_notices() { return impl().take_notices(); }
void MapWriter::add_pose(const MapLoopPose& pose) { impl().add_pose(pose); }
void MapWriter::flush() { impl().flush(); }
void MapWriter::finish() { impl().finish(); }
void MapWriter::finish_unless(const std::function<bool()>& is_stopped) {
  impl().finish(is_stopped);
}
std::vector<std::string> MapWriter::damage() const { return impl().damage(); }

void MapWriter::check_options(const LoopDetectorOptions& options) { impl().check_options(options); }

void MapWriter::for_each_earlier_place(const Visit& visit) { impl().for_each_earlier_place(visit); }
void MapWriter::for_each_earlier_loop(const VisitLoop& visit) {
  impl().for_each_earlier_loop(visit);
}

std::int64_t MapWriter::epoch() { return impl().epoch(); }

MapNews MapWriter::news() { return impl().news(); }

std::shared_ptr<const Features> MapWriter::features(PlaceId place) {
  return impl().features(place);
}

void MapWriter::add(const Detection& detection, const BinaryContent& content,
                    std::shared_ptr<const Features> features, const cv::Mat& image) {
  impl().add(detection, content, std::move(features), image);
}

void MapWriter::remove(PlaceId place) { impl().remove(place); }

void MapWriter::reject(const SessionFrame& query, const SessionFrame& match) {
  impl().reject(query, match);
}

}  // namespace loopbit
