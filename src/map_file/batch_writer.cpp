// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "batch_writer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "file_database.hpp"

namespace loopbit {
namespace {

/// None unless it is finite.
std::optional<double> time_of(const Detection& detection) {
  const bool has_time = detection.timestamp_s && std::isfinite(*detection.timestamp_s);
  return has_time ? detection.timestamp_s : std::nullopt;
}

constexpr std::size_t kFramesPerBatch = 32;
/// 12 MB of features, and 50 MB of images if these are saved.
constexpr std::size_t kMaxPendingFrames = 256;

}  // namespace

BatchWriter::BatchWriter(std::unique_ptr<MapDatabase> database, MapSession session,
                         std::int64_t first_place, const OdometryDrift& drift,
                         EncodeImage encode_image, BatchOptions options)
    : database_(std::move(database)),
      session_(std::move(session)),
      first_place_(first_place),
      drift_(drift),
      encode_image_(std::move(encode_image)),
      options_(std::move(options)),
      thread_([this] { commit_batches(); }) {}

BatchWriter::~BatchWriter() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  added_.notify_all();
  thread_.join();
}

void BatchWriter::add(AddedFrame frame) {
  std::unique_lock lock(mutex_);
  committed_.wait(lock, [&] { return error_ || pending_.size() < kMaxPendingFrames; });
  if (error_) std::rethrow_exception(error_);
  if (frame.detection.odometry) complete(*frame.detection.odometry);
  pending_.push_back(std::move(frame));
  if (pending_.size() == 1 || pending_.size() >= kFramesPerBatch) added_.notify_all();
}

/// Here, because a batch may be written twice.
void BatchWriter::complete(OdometryPose& pose) {
  const cv::Matx44d& now = pose.T_odometry_camera;
  pose.covariance = odometry_step(last_pose_.value_or(now), pose, drift_).covariance;
  last_pose_ = now;
}

void BatchWriter::change(std::function<void(const MapDatabase&)> change) {
  const std::lock_guard lock(mutex_);
  if (error_) std::rethrow_exception(error_);
  changes_.push_back(std::move(change));
  added_.notify_all();
}

void BatchWriter::flush() {
  std::unique_lock lock(mutex_);
  in_a_hurry_ = true;
  added_.notify_all();
  committed_.wait(lock, [&] { return error_ || (pending_.empty() && changes_.empty()); });
  in_a_hurry_ = false;
  if (error_) std::rethrow_exception(error_);
}

std::shared_ptr<const Features> BatchWriter::pending(int frame) const {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::lower_bound(pending_.begin(), pending_.end(), frame,
                       [](const AddedFrame& a, int number) { return a.detection.frame < number; });
  if (found == pending_.end() || found->detection.frame != frame) return nullptr;
  return found->features;
}

std::int64_t BatchWriter::saved_frames() const {
  const std::lock_guard lock(mutex_);
  return saved_frames_;
}

void BatchWriter::add_other(MapSession session) {
  session.frames = 0;
  session.linked = false;
  const std::lock_guard lock(mutex_);
  others_[session.session] = std::move(session);
}

void BatchWriter::close() {
  if (!database_) return;
  rows_.reset();
  database_->close();
  database_.reset();
}

void BatchWriter::commit_batches() {
  std::unique_lock lock(mutex_);
  while (!stop_) {
    added_.wait(lock, [&] { return stop_ || !pending_.empty() || !changes_.empty(); });
    added_.wait_for(lock, options_.max_delay,
                    [&] { return stop_ || in_a_hurry_ || pending_.size() >= kFramesPerBatch; });
    if (stop_) return;
    std::vector<AddedFrame> batch;
    Changes changes;
    std::exception_ptr error;
    try {
      batch.assign(pending_.begin(), pending_.end());
      changes = changes_;
      lock.unlock();
      commit(batch, changes);
    } catch (...) {
      error = std::current_exception();
    }
    if (!lock.owns_lock()) lock.lock();
    if (error) {
      error_ = error;
    } else {
      pending_.erase(pending_.begin(),
                     pending_.begin() + static_cast<std::ptrdiff_t>(batch.size()));
      changes_.erase(changes_.begin(),
                     changes_.begin() + static_cast<std::ptrdiff_t>(changes.size()));
      saved_frames_ += static_cast<std::int64_t>(batch.size());
    }
    if (!error_ && options_.on_commit) options_.on_commit();
    committed_.notify_all();
    if (error_) return;
  }
}

void BatchWriter::commit(const std::vector<AddedFrame>& batch, const Changes& changes) {
  if (!database_) database_ = open_map(options_.path, MapDatabase::Access::write);
  const auto transaction = database_->begin();
  if (!rows_) rows_.emplace(*database_);
  if (!batch.empty()) {
    MapSession session = session_;
    session.frames = batch.back().detection.frame + 1;
    rows_->write(session);
    if (session_.frames == 0 && session.linked) rows_->write_linked(session.session);
  }
  for (const AddedFrame& frame : batch) write(frame);
  for (const auto& change : changes) change(*database_);
  transaction->end();
  if (!batch.empty()) session_.frames = batch.back().detection.frame + 1;
}

void BatchWriter::write(const MapLoop& loop) {
  std::map<int, MapSession>::node_type other;
  {
    const std::lock_guard lock(mutex_);
    other = others_.extract(loop.match.session);
  }
  if (!other.empty()) rows_->write(other.mapped());
  rows_->write(loop);
}

void BatchWriter::write(const AddedFrame& frame) {
  const Detection& detection = frame.detection;
  if (detection.odometry) {
    rows_->write({.at = {session_.session, detection.frame},
                  .timestamp_s = time_of(detection),
                  .pose = *detection.odometry});
  }
  if (detection.status == Status::unreadable) return;
  const MapPlace place{.id = first_place_ + detection.frame,
                       .at = {session_.session, detection.frame},
                       .timestamp_s = time_of(detection),
                       .content = frame.content};
  rows_->write(place, *frame.features);
  if (!frame.image.empty()) rows_->write_image(place, encode_image_(frame.image));
  if (detection.status == Status::loop) write(loop_of(detection, session_.session));
  for (const LateLoop& late : detection.withdrawn_loops) {
    const MapLoop loop = loop_of(late, session_.session);
    reject_loop(*database_, loop.query, loop.match);
  }
  for (const LateLoop& late : detection.late_loops) {
    write(loop_of(late, session_.session));
  }
}

}  // namespace loopbit
