// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "loopbit/map_database.hpp"
#include "loopbit/map_file.hpp"

#include "map_rows.hpp"

namespace loopbit {

/// A frame to be written to a map.
struct AddedFrame {
  BinaryContent content;
  Detection detection;
  std::shared_ptr<const Features> features;
  cv::Mat image = {};  ///< a copy; empty if no image is saved
};

/// How frames are committed.
struct BatchOptions {
  std::chrono::milliseconds max_delay{1000};
  std::function<void()> on_commit = {};  ///< called on the writer's thread
  /// Of the map file that is written if no database is given. It is opened on the writer's thread,
  /// because that takes tens of milliseconds if it has to be made.
  std::string path = {};
};

/// Commits the frames of one session in batches, on a thread of its own. The id of frame k's place
/// is first_place + k. One thread at a time may call it.
class BatchWriter {
 public:
  /// `database`: null if `options` have a path. `drift`: of odometry without covariances.
  /// `encode_image` may be empty.
  BatchWriter(std::unique_ptr<MapDatabase> database, MapSession session, std::int64_t first_place,
              const OdometryDrift& drift, EncodeImage encode_image, BatchOptions options = {});
  /// Drops uncommitted frames.
  ~BatchWriter();
  BatchWriter(const BatchWriter&) = delete;
  BatchWriter& operator=(const BatchWriter&) = delete;
  BatchWriter(BatchWriter&&) = delete;
  BatchWriter& operator=(BatchWriter&&) = delete;

  /// Waits while too many frames are pending. Throws the Error of an earlier frame.
  void add(AddedFrame frame);

  /// A session of another map. The map gets its description, without frames, with the first loop
  /// that leads there.
  void add_other(MapSession session);

  /// Makes `change` part of a commit, after all frames that were added so far.
  void change(std::function<void(const MapDatabase&)> change);

  /// Waits until all is committed. Throws the Error if it cannot be.
  void flush();

  /// The features of a frame that is not committed yet, otherwise null.
  [[nodiscard]] std::shared_ptr<const Features> pending(int frame) const;

  [[nodiscard]] std::int64_t saved_frames() const;

  /// Call this once, after flush(). Releases the lock of the map and, if nobody reads it, leaves
  /// one file without a log.
  void close();

 private:
  using Changes = std::vector<std::function<void(const MapDatabase&)>>;

  void commit_batches();
  void commit(const std::vector<AddedFrame>& batch, const Changes& changes);
  void write(const AddedFrame& frame);
  void write(const MapLoop& loop);
  /// Gives it the covariance since the pose before, if it has none.
  void complete(OdometryPose& pose);

  std::unique_ptr<MapDatabase> database_;
  std::optional<RowWriter> rows_;  ///< from the first commit on: an older map lacks tables
  MapSession session_;             ///< session_.frames are committed; for the thread only
  std::int64_t first_place_;
  OdometryDrift drift_;
  std::optional<cv::Matx44d> last_pose_;  ///< by odometry, of the last frame that was added
  EncodeImage encode_image_;
  BatchOptions options_;

  mutable std::mutex mutex_;  ///< guards all below
  std::condition_variable added_;
  std::condition_variable committed_;
  std::deque<AddedFrame> pending_;
  Changes changes_;
  std::map<int, MapSession> others_;  ///< by number; those that the map lacks
  std::int64_t saved_frames_ = 0;
  std::exception_ptr error_;
  bool in_a_hurry_ = false;
  bool stop_ = false;
  std::thread thread_;  ///< last: it uses all the others
};

}  // namespace loopbit
