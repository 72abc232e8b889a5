// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/binary_content.hpp"
#include "loopbit/detection.hpp"
#include "loopbit/known_motion.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/map_storage.hpp"
#include "loopbit/odometry.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

/// One continuous recording in a map.
struct MapSession {
  int session = 0;          ///< counts from 1; never reused in a map
  std::string uid;          ///< 32 hexadecimal digits, the same in every copy of the session
  std::string name;         ///< the input, as the user named it
  std::string started;      ///< UTC, "2026-11-21T15:04:05Z"
  std::string loopbit;      ///< the version that wrote it
  std::string options;      ///< settings of its detector, as to_json() writes them
  std::int64_t frames = 0;  ///< including unreadable ones, which have no place
  bool linked = false;      ///< compared with all earlier sessions, when recorded or by link_map()
};

/// A place in a map.
struct MapPlace {
  std::int64_t id = 0;  ///< the row's key; never reused in a map
  SessionFrame at;
  std::optional<double> timestamp_s = std::nullopt;
  BinaryContent content = {};
};

/// A loop that was found when its query was added, or by link_map().
struct MapLoop {
  SessionFrame query;
  SessionFrame match;
  double score = 0;
  double similarity = 0;
  int matches = 0;
  int inliers = 0;

  bool operator==(const MapLoop&) const = default;
};

/// What odometry said at a frame, whether it is a place or not.
struct MapOdometry {
  SessionFrame at;
  std::optional<double> timestamp_s = std::nullopt;
  /// Always with the covariance of the motion since the frame with odometry before.
  OdometryPose pose = {};
};

/// The relative pose of a loop, as the run measured it that found the loop.
struct MapLoopPose {
  SessionFrame query;
  SessionFrame match;
  KnownMotion measured = {};  ///< T_from_to is T_match_query
};

/// The images of a map and their total size.
struct MapImages {
  std::int64_t number = 0;
  std::int64_t bytes = 0;
};

/// Encodes an image as a small JPEG file; see picture_jpeg.hpp.
using EncodeImage = std::function<std::vector<unsigned char>(const cv::Mat&)>;

/// The default size of the cache of recently used features. The cache changes no result, only how
/// often features are read from the file again. 64 MiB hold about 1,400 places, or minutes of
/// driving, and are a small part of a robot's memory.
inline constexpr std::size_t kMapCache_mb = 64;

/// Reads a map on disk, also while a MapWriter writes it: each call sees what is committed by then.
/// docs/format.md describes the file. Every row has a checksum; damaged rows are left out. A map
/// may have any number of readers. A reader serves the queries of one LoopDetector: for a second
/// one, and in add(), remove() and reject(), it throws Error (kind option). Not thread-safe.
class MapReader : public MapStorage {
 public:
  using VisitPlace = std::function<void(const MapPlace&)>;

  /// Reads the sessions only. Throws Error (kind input) if there is no map, it has a newer version,
  /// or its list of tables is damaged.
  explicit MapReader(const std::string& path, std::size_t cache_mb = kMapCache_mb);
  ~MapReader() override;
  MapReader(const MapReader&) = delete;
  MapReader& operator=(const MapReader&) = delete;
  MapReader(MapReader&&) = delete;
  MapReader& operator=(MapReader&&) = delete;

  [[nodiscard]] const std::vector<MapSession>& sessions() const;

  /// The defaults, with the settings that determined the map's places. Throws Error (kind input) if
  /// the map has no session.
  [[nodiscard]] LoopDetectorOptions options() const;

  /// Calls visit(place) for every undamaged place, in order of id. Does not read features. Takes
  /// about 1 us per place.
  void for_each_place(const VisitPlace& visit);

  /// The undamaged loops, in the order in which they were found.
  [[nodiscard]] std::vector<MapLoop> loops();

  /// The undamaged loops that LoopDetector::reject() or a pose graph withdrew.
  [[nodiscard]] std::vector<MapLoop> rejected_loops();

  /// The undamaged odometry of all frames that have some, by session and frame.
  [[nodiscard]] std::vector<MapOdometry> odometry();

  /// The undamaged relative poses, also of loops that were rejected later, in the order in which
  /// they were measured.
  [[nodiscard]] std::vector<MapLoopPose> loop_poses();

  /// What is known of the motion from match to query of each of `loops`, as it was measured last;
  /// nothing if it was not, or is damaged.
  [[nodiscard]] std::vector<KnownMotion> motions_of(const std::vector<MapLoop>& loops);

  /// None if they are damaged or missing.
  [[nodiscard]] std::optional<Features> features_of(const MapPlace& place);

  /// Counts damaged images, too. Takes about 1 us per image.
  [[nodiscard]] MapImages images();

  /// The bytes of a JPEG file. None if the place has no image, or a damaged one, which damage()
  /// then lists.
  [[nodiscard]] std::optional<std::vector<unsigned char>> image_of(const MapPlace& place);

  /// One clause for each damage found so far, such as "place 7 (session 1, frame 6): its features
  /// are missing or differ from their checksum".
  [[nodiscard]] const std::vector<std::string>& damage() const;

  /// The size on disk.
  [[nodiscard]] std::int64_t bytes() const;

  /// The faults that SQLite's integrity_check finds in the file. Empty for a map on a server.
  [[nodiscard]] std::vector<std::string> check_structure() const;

  /// Of a map on a server, the address without passwords.
  [[nodiscard]] const std::string& path() const;

  /// A server that answers later than this is an Error (kind input); 0 = it may take any time.
  void set_time_limit(std::chrono::milliseconds limit);

  /// Reads the sessions again. Until the next call, all that is read was committed before.
  void begin_snapshot();

  /// From now on, a LoopDetector of this map sees what was committed up to this epoch, without what
  /// was removed or rejected since then. Throws Error (kind option) if the map is not on a server
  /// or has not reached this epoch.
  void set_epoch(std::int64_t epoch);

  void check_options(const LoopDetectorOptions& options) override;
  std::int64_t epoch() override;
  /// Of a map on a server that has the extension and its index. Without it, and of a file, null.
  PlaceSearch* place_search() override;
  void for_each_earlier_place(const Visit& visit) override;
  void for_each_earlier_loop(const VisitLoop& visit) override;
  std::shared_ptr<const Features> features(PlaceId place) override;
  void add(const Detection& detection, const BinaryContent& content,
           std::shared_ptr<const Features> features, const cv::Mat& image) override;
  void remove(PlaceId place) override;
  void reject(const SessionFrame& query, const SessionFrame& match) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Adds a session of a LoopDetector to a map on disk. A map has one writer.
///
/// A thread commits the frames in batches of 32, or after one second. Committed frames survive
/// SIGKILL and a power failure. add() waits only when that thread is 256 frames behind. In a forked
/// child every call throws Error (kind option).
class MapWriter : public MapStorage {
 public:
  /// Creates or continues the map at `path`. Of several addresses of servers, separated by spaces,
  /// the first one gets the session; the sessions of the others are recognised, too. `name`
  /// describes the input of the session. An existing map is not changed before the first commit.
  /// Throws Error: kind output if the map has a writer or cannot be written, option if it was made
  /// with other settings of binary_content or surf, input as MapReader does.
  ///
  /// `encode_image`: if given, an image of each place is saved. It is called on the writer's thread
  /// with a copy made by halved_to_picture(), which costs add() about 0.1 ms. If it returns no
  /// bytes, no image is saved. If it throws, later calls of the writer throw the same.
  MapWriter(const std::string& path, const LoopDetectorOptions& options, const std::string& name,
            EncodeImage encode_image = {}, std::size_t cache_mb = kMapCache_mb);
  /// Calls finish() if the caller did not, and ignores its error.
  ~MapWriter() override;
  MapWriter(const MapWriter&) = delete;
  MapWriter& operator=(const MapWriter&) = delete;
  MapWriter(MapWriter&&) = delete;
  MapWriter& operator=(MapWriter&&) = delete;

  /// Throws Error (kind option) in a forked child. Never waits.
  void check_process() const;

  /// The number of this session.
  [[nodiscard]] int session() const;

  /// The number of committed frames of this session.
  [[nodiscard]] std::int64_t saved_frames() const;

  // A map on a server: frames are queued in a map file and copied from there, so that nothing waits
  // for the server. merge_map() also copies them. While the server is lost, places whose features
  // cannot be had are no match.

  /// The file of the queue. Call this before the first frame. The default is
  /// "town_session_2_queue.db" in the working folder; if there is such a file, it gets a number.
  void set_queue(const std::string& path);

  /// That file; empty for a map file, and after finish() if the server has everything.
  [[nodiscard]] const std::string& queue() const;

  /// How often the server did not take frames for a while, and did so later.
  [[nodiscard]] int reconnections() const;

  /// How often the features of a place could not be had.
  [[nodiscard]] std::int64_t unverified() const;

  /// Of several servers, those that did not answer, at the start or for a while, without passwords.
  [[nodiscard]] std::vector<std::string> not_asked() const;

  /// Sentences on the server, for the user, since the last call.
  std::vector<std::string> take_notices();

  /// Saves the relative pose of a loop, unless nothing of it is known. Session 0 is this session.
  /// Throws Error (kind output).
  void add_pose(const MapLoopPose& pose);

  /// Commits all frames added so far, also on a server. Throws Error (kind output).
  void flush();

  /// Commits the rest and closes the file. The file then contains the whole map, without a log
  /// beside it unless another process reads it, and others may write it. Throws Error (kind
  /// output). Later calls by the detector of this map throw Error (kind option). What a server does
  /// not take stays in queue().
  void finish();

  /// The same, but once `is_stopped()` is true, waits at most two seconds for a server, and not at
  /// all for one that did not take the frames before.
  void finish_unless(const std::function<bool()>& is_stopped);

  /// The damage that features() found so far; see MapReader::damage().
  [[nodiscard]] std::vector<std::string> damage() const;

  void check_options(const LoopDetectorOptions& options) override;
  /// A writer serves one LoopDetector: a second call throws Error (kind option). Both functions
  /// throw Error (kind input) if a session, place or loop is damaged, since such a map is not
  /// continued.
  void for_each_earlier_place(const Visit& visit) override;
  void for_each_earlier_loop(const VisitLoop& visit) override;
  std::int64_t epoch() override;
  MapNews news() override;
  /// Empty if they are damaged. The session continues, and damage() lists them.
  std::shared_ptr<const Features> features(PlaceId place) override;
  void add(const Detection& detection, const BinaryContent& content,
           std::shared_ptr<const Features> features, const cv::Mat& image) override;
  void remove(PlaceId place) override;
  void reject(const SessionFrame& query, const SessionFrame& match) override;

 private:
  class Impl;
  [[nodiscard]] Impl& impl() const;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loopbit
