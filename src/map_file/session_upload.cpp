// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "session_upload.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <utility>

#include <fmt/format.h>

#include "file_database.hpp"
#include "map_rows.hpp"
#include "server_limits.hpp"

namespace loopbit {
namespace {

/// Whoever stops a run waits no longer for a server that answers.
constexpr std::chrono::seconds kMaxFarewell{2};
constexpr std::chrono::milliseconds kLookForStop{20};
/// 25 MB of features.
constexpr std::int64_t kFramesAtOnce = 512;

}  // namespace

/// The rows of a session in the file that queues it, and which of them were copied.
class QueuedRows {
 public:
  explicit QueuedRows(const std::string& path)
      : file_(open_map(path, MapDatabase::Access::read)), features_(*file_), images_(*file_) {}

  /// Whether the next copy() has something to do; notes where it ends.
  bool has_more(int session) {
    const auto row = file_->prepare(
        "SELECT frames, (SELECT coalesce(max(loop), 0) FROM loop), (SELECT coalesce(max(rejected), "
        "0) FROM rejected), (SELECT coalesce(max(odometry), 0) FROM odometry), (SELECT "
        "coalesce(max(relative_pose), 0) FROM relative_pose) FROM session WHERE session = ?1");
    row->bind(1, std::int64_t{session});
    if (!row->step()) return false;
    for (std::size_t i = 0; i < next_.size(); ++i) next_[i] = row->integer(static_cast<int>(i));
    next_[Column::frames] =
        std::min(next_[Column::frames], copied_[Column::frames] + kFramesAtOnce);
    next_[Column::odometry] =
        std::min(next_[Column::odometry], copied_[Column::odometry] + kFramesAtOnce);
    return next_ != copied_;
  }

  /// Copies rows of the session with the description `session` and the key of its first place, in
  /// the current transaction. `known`: what `to` has of it, if that is not sure. Returns the frames
  /// that it has then.
  std::int64_t copy(const MapDatabase& to, MapSession session, std::int64_t first_place,
                    const std::optional<KnownRows>& known) {
    const std::int64_t begin = std::max(copied_[Column::frames], known ? known->frames : 0);
    next_[Column::frames] = std::max(next_[Column::frames], begin);
    RowWriter rows(to);
    session.frames = next_[Column::frames];
    rows.write(session);
    for_each_place(*file_,
                   [&](const MapPlace& place) {
                     const auto features = features_.read(place.id, place.at, damage_);
                     if (!features) return;
                     rows.write(place, *features);
                     const auto image = images_.read(place.id, place.at, damage_);
                     if (image) rows.write_image(place, *image);
                   },
                   damage_, {first_place + begin, first_place + next_[Column::frames] - 1});
    for (const MapOdometry& odometry : read_odometry(*file_, damage_, keys(Column::odometry))) {
      if (!known || odometry.at.frame >= known->frames) rows.write(odometry);
    }
    for (const MapLoop& loop : read_rejected_loops(*file_, damage_, keys(Column::rejected))) {
      if (loop.query.session == session.session) reject_loop(to, loop);
    }
    for (const MapLoop& loop : read_loops(*file_, damage_, keys(Column::loop))) {
      const auto pair = KnownRows::pair(loop.query, loop.match);
      if (!known || !(known->loops.contains(pair) || known->rejected.contains(pair))) {
        rows.write(loop);
      }
    }
    for (const MapLoopPose& pose : read_loop_poses(*file_, damage_, keys(Column::pose))) {
      if (!known || !known->poses.contains(KnownRows::pair(pose.query, pose.match))) {
        rows.write(pose);
      }
    }
    return session.frames;
  }

  /// The transaction was committed.
  void advance() { copied_ = next_; }

  [[nodiscard]] bool is_first() const { return copied_[Column::frames] == 0; }
  [[nodiscard]] const std::vector<std::string>& damage() const { return damage_.clauses(); }

 private:
  struct Column {
    enum Number : std::size_t { frames, loop, rejected, odometry, pose };
  };
  using Ends = std::array<std::int64_t, 5>;  ///< number of frames, then the last keys of tables

  [[nodiscard]] KeyRange keys(Column::Number table) const {
    return {copied_[table] + 1, next_[table]};
  }

  std::unique_ptr<MapDatabase> file_;
  FeatureReader features_;
  ImageReader images_;
  Damage damage_;
  Ends copied_{};
  Ends next_{};
};

SessionUpload::SessionUpload(std::unique_ptr<MapDatabase> server, Begun begun, std::string queue)
    : server_(std::move(server)), begun_(std::move(begun)), queue_(std::move(queue)) {
  server_->set_time_limit(kMaxAnswer);
  thread_ = std::thread([this] { run(); });
}

SessionUpload::~SessionUpload() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  server_->interrupt();
  woken_.notify_all();
  thread_.join();
}

void SessionUpload::wake(std::vector<Change> changes) {
  const std::lock_guard lock(mutex_);
  ++wakes_;
  changes_.insert(changes_.end(), std::move_iterator(changes.begin()),
                  std::move_iterator(changes.end()));
  woken_.notify_all();
}

bool SessionUpload::catch_up(const std::function<bool()>& is_stopped) {
  std::unique_lock lock(mutex_);
  // One that has begun may have failed already, and a server may end a connection once more.
  const std::int64_t attempt = attempts_ + 2;
  in_a_hurry_ = true;
  woken_.notify_all();
  std::optional<std::chrono::steady_clock::time_point> end;
  while (copied_ < wakes_) {
    const bool stops = is_stopped && is_stopped();
    if (fault_ && (stops || attempts_ >= attempt)) return false;
    const auto now = std::chrono::steady_clock::now();
    if (stops && !end) end = now + kMaxFarewell;
    if (end && now > *end) return false;
    tried_.wait_for(lock, kLookForStop);
  }
  return true;
}

std::optional<Error> SessionUpload::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

std::int64_t SessionUpload::saved_frames() const {
  const std::lock_guard lock(mutex_);
  return saved_frames_;
}

int SessionUpload::reconnections() const {
  const std::lock_guard lock(mutex_);
  return reconnections_;
}

std::vector<std::string> SessionUpload::take_notices() {
  const std::lock_guard lock(mutex_);
  return std::exchange(notices_, {});
}

void SessionUpload::run() {
  RetryPause pause;
  std::unique_lock lock(mutex_);
  while (true) {
    if (fault_) {
      woken_.wait_for(lock, pause.next(), [&] { return stop_ || in_a_hurry_; });
    } else {
      woken_.wait(lock, [&] { return stop_ || copied_ < wakes_; });
    }
    if (stop_) return;
    in_a_hurry_ = false;
    const std::int64_t wakes = wakes_;
    lock.unlock();
    std::optional<Error> fault;
    bool was_lost = false;
    try {
      was_lost = attempt();
    } catch (const Error& error) {
      fault = error;
    } catch (const std::exception& error) {  // no memory: later there may be some
      fault = Error(ErrorKind::output, error.what());
    }
    lock.lock();
    ++attempts_;
    if (!fault) {
      copied_ = wakes;
      pause.reset();
    }
    if (!fault && (fault_ || was_lost)) ++reconnections_;
    note_change(fault);
    fault_ = fault;
    tried_.notify_all();
  }
}

/// Of fault_. The mutex is locked.
void SessionUpload::note_change(const std::optional<Error>& fault) {
  if (fault && !fault_) {
    notices_.push_back(
        fmt::format("The server does not take what the run finds, which is queued in '{}': {}",
                    queue_, fault->what()));
  } else if (!fault && fault_) {
    notices_.push_back(fmt::format("The server of '{}' takes it again.", server_->path()));
  }
}

/// Throws Error if the server does not take everything. Returns whether it had to be reached again.
bool SessionUpload::attempt() {
  bool was_lost = server_->is_lost();
  if (was_lost) server_->reconnect();
  try {
    copy_all();
  } catch (const Error&) {
    if (was_lost || !server_->is_lost()) throw;
    was_lost = true;
    server_->reconnect();
    copy_all();
  }
  return was_lost;
}

void SessionUpload::copy_all() {
  while (copy_some()) {
  }
  make_changes();
}

/// False if there is nothing to copy.
bool SessionUpload::copy_some() {
  if (!rows_) rows_ = std::make_unique<QueuedRows>(queue_);
  const int number = begun_.session.session;
  if (!rows_->has_more(number)) return false;
  // What was committed is not sure any more if the answer is lost.
  const bool was_sure = std::exchange(is_sure_, false);
  const auto transaction = server_->begin();
  std::optional<KnownRows> known;
  if (!was_sure) known = known_rows(*server_, number)[number];
  const std::int64_t frames = rows_->copy(*server_, begun_.session, begun_.first_place, known);
  if (rows_->is_first() && begun_.session.linked) link();
  transaction->end();
  is_sure_ = true;
  rows_->advance();
  const std::lock_guard lock(mutex_);
  saved_frames_ = frames;
  for (; damage_ < rows_->damage().size(); ++damage_) {
    notices_.push_back(fmt::format("'{}': {}", queue_, rows_->damage()[damage_]));
  }
  return true;
}

/// Unless an earlier session has grown since this one began.
void SessionUpload::link() {
  server_->hold_back_commits();
  const auto row = server_->prepare(
      "SELECT CAST(coalesce(sum(frames), 0) AS bigint) FROM session WHERE session < ?1");
  row->bind(1, std::int64_t{begun_.session.session});
  if (!row->step() || row->integer(0) != begun_.earlier_frames) return;
  RowWriter(*server_).write_linked(begun_.session.session);
}

void SessionUpload::make_changes() {
  while (true) {
    Change change;
    {
      const std::lock_guard lock(mutex_);
      if (changes_.empty()) return;
      change = changes_.front();
    }
    std::string refusal;
    try {
      const auto transaction = server_->begin();
      change(*server_);
      transaction->end();
    } catch (const Error& error) {
      if (server_->is_lost()) throw;
      refusal = error.what();
    }
    const std::lock_guard lock(mutex_);
    changes_.erase(changes_.begin());
    if (!refusal.empty()) notices_.push_back(refusal);
  }
}

}  // namespace loopbit
