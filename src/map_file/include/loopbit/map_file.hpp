// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

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
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/map_storage.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

/// One continuous recording in a map.
struct MapSession {
  int session = 0;          ///< from 1; never given twice in a map
  std::string uid;          ///< 32 hexadecimal digits, the same in every copy of the session
  std::string name;         ///< what was read, as the user named it
  std::string started;      ///< UTC, "2026-11-21T15:04:05Z"
  std::string loopbit;      ///< the version that wrote it
  std::string options;      ///< of its detector, as to_json gives them
  std::int64_t frames = 0;  ///< with the unreadable ones, which are no places
};

/// A place as a map has it.
struct MapPlace {
  std::int64_t id = 0;  ///< the row's key; never given twice in a map
  SessionFrame at;
  std::optional<double> timestamp_s = std::nullopt;
  BinaryContent content = {};
};

/// A loop that was found when its query was added.
struct MapLoop {
  SessionFrame query;
  SessionFrame match;
  double score = 0;
  double similarity = 0;
  int matches = 0;
  int inliers = 0;

  bool operator==(const MapLoop&) const = default;
};

/// How many places of a map have an image, and what the images take.
struct MapImages {
  std::int64_t number = 0;
  std::int64_t bytes = 0;
};

/// Makes the bytes of a small JPEG file of an image; see picture_jpeg.hpp.
using EncodeImage = std::function<std::vector<unsigned char>(const cv::Mat&)>;

/// Recently used features stay in memory, up to this many MiB by default. The cache changes no
/// result, only how often features are read from the file again. 64 MiB hold about 1,400 places, or
/// minutes of driving, and are a small part of a robot's memory.
inline constexpr std::size_t kMapCache_mb = 64;

/// A map on disk, to be read, also while it is being written: a reader sees what was committed when
/// it looked. docs/format.md describes the file. What is damaged is left out, never guessed: every
/// row has a checksum. Not thread-safe; any number of readers.
class MapReader : public MapStorage {
 public:
  using VisitPlace = std::function<void(const MapPlace&)>;

  /// Throws Error (kind input) if there is no map, it is of a newer version, or it is damaged where
  /// its tables are listed. Reads the sessions only.
  explicit MapReader(const std::string& path, std::size_t cache_mb = kMapCache_mb);
  ~MapReader() override;
  MapReader(const MapReader&) = delete;
  MapReader& operator=(const MapReader&) = delete;
  MapReader(MapReader&&) = delete;
  MapReader& operator=(MapReader&&) = delete;

  [[nodiscard]] const std::vector<MapSession>& sessions() const;

  /// The defaults, with the settings that the map's places were made with. Throws Error (kind
  /// input) if no session says.
  [[nodiscard]] LoopDetectorOptions options() const;

  /// Calls back with every place that is whole, in order of id. A microsecond a place; features are
  /// not touched.
  void for_each_place(const VisitPlace& visit);

  /// The loops that are whole, in the order in which they were found.
  [[nodiscard]] std::vector<MapLoop> loops();

  /// None if they are lost.
  [[nodiscard]] std::optional<Features> features_of(const MapPlace& place);

  /// Those that the map lists, damaged or not. A microsecond an image.
  [[nodiscard]] MapImages images();

  /// The bytes of a JPEG file. None if none was kept, or if it is lost, which damage() then says.
  [[nodiscard]] std::optional<std::vector<unsigned char>> image_of(const MapPlace& place);

  /// One clause for each thing found damaged so far, such as "place 7 (session 1, frame 6): its
  /// content differs from its checksum".
  [[nodiscard]] const std::vector<std::string>& damage() const;

  /// The file itself is looked at: what SQLite's integrity_check says, nothing if all is well.
  [[nodiscard]] std::vector<std::string> check_structure() const;

  [[nodiscard]] const std::string& path() const;

  void check_options(const LoopDetectorOptions& options) override;
  // For the queries of one LoopDetector: that of another throws Error (kind option), as add() does.
  void for_each_earlier_place(const Visit& visit) override;
  void for_each_earlier_loop(const VisitLoop& visit) override;
  std::shared_ptr<const Features> features(PlaceId place) override;
  void add(const Detection& detection, const BinaryContent& content,
           std::shared_ptr<const Features> features, const cv::Mat& image) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A map on disk that a LoopDetector continues with a session of its own. A map has one writer.
///
/// Frames are handed to a thread that commits them in batches of 32 or, at the latest, after a
/// second; what is committed survives SIGKILL and the loss of power. add() waits only where that
/// thread is 256 frames behind. In a forked child every call throws Error
/// (kind option).
class MapWriter : public MapStorage {
 public:
  /// Creates or continues the map at `path`; `name` says what the session reads. Throws Error
  /// (kind output) if the map has a writer or cannot be written, (kind option) if it was made with
  /// other settings of binary_content or surf, (kind input) as MapReader does. A session without
  /// frames leaves no trace: nothing is written to a map before its first frame.
  ///
  /// `encode_image`: if given, an image of each place is kept. It is called on that thread, with a
  /// copy of the image as halved_to_picture() makes it, which costs add() some 0.1 ms; nothing is
  /// kept where it gives no bytes, and what it throws, later calls throw.
  MapWriter(const std::string& path, const LoopDetectorOptions& options, const std::string& name,
            EncodeImage encode_image = {}, std::size_t cache_mb = kMapCache_mb);
  /// Saves as finish() does, if it was not called, and swallows its error.
  ~MapWriter() override;
  MapWriter(const MapWriter&) = delete;
  MapWriter& operator=(const MapWriter&) = delete;
  MapWriter(MapWriter&&) = delete;
  MapWriter& operator=(MapWriter&&) = delete;

  /// Throws Error (kind option) in a forked child. Never waits.
  void check_process() const;

  /// The number of the session that is written.
  [[nodiscard]] int session() const;

  /// Frames of this session that are committed: nothing takes them away again.
  [[nodiscard]] std::int64_t saved_frames() const;

  /// Commits what was added so far. Throws Error (kind output).
  void flush();

  /// Commits the rest and closes the file, which then holds all of it and may be written by others.
  /// There is no log beside it then, unless somebody reads the map. Throws Error (kind output). A
  /// detector of this map is of no use afterwards: what it asks for throws Error (kind option).
  void finish();

  /// What features() found damaged so far, as MapReader::damage says it.
  [[nodiscard]] const std::vector<std::string>& damage() const;

  void check_options(const LoopDetectorOptions& options) override;
  /// For one LoopDetector: the first throws Error (kind option) when it is called again.
  /// These two throw Error (kind input) where a session, place or loop is damaged: such a map is
  /// not written to.
  void for_each_earlier_place(const Visit& visit) override;
  void for_each_earlier_loop(const VisitLoop& visit) override;
  /// Without any if they are lost: found only now, so the session goes on, and damage() says it.
  std::shared_ptr<const Features> features(PlaceId place) override;
  void add(const Detection& detection, const BinaryContent& content,
           std::shared_ptr<const Features> features, const cv::Mat& image) override;

 private:
  class Impl;
  [[nodiscard]] Impl& impl() const;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loopbit
