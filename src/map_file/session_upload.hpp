// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "loopbit/error.hpp"
#include "loopbit/map_database.hpp"
#include "loopbit/map_file.hpp"

namespace loopbit {

class QueuedRows;

/// Copies a session from the map file that queues it to a server, on a thread of its own, while the
/// session is being written. What the server does not take stays in the file, and is tried again
/// after 0.1 s and then in longer steps of up to 1 s. One other thread may call it.
class SessionUpload {
 public:
  using Change = std::function<void(const MapDatabase&)>;

  /// What a session began with.
  struct Begun {
    MapSession session;               ///< session.linked: if no earlier session grew meanwhile
    std::int64_t first_place = 0;     ///< the key of frame 0
    std::int64_t earlier_frames = 0;  ///< of the sessions before it
  };

  /// `server`: that holds the session. `queue`: the file, which need not be there before the first
  /// wake().
  SessionUpload(std::unique_ptr<MapDatabase> server, Begun begun, std::string queue);
  /// Stops at once, whatever the server does.
  ~SessionUpload();
  SessionUpload(const SessionUpload&) = delete;
  SessionUpload& operator=(const SessionUpload&) = delete;
  SessionUpload(SessionUpload&&) = delete;
  SessionUpload& operator=(SessionUpload&&) = delete;

  /// Call this when something was committed to the file. `changes`: of what is not in it. They are
  /// dropped, with a notice, if the server refuses them.
  void wake(std::vector<Change> changes = {});

  /// Waits until the server has everything, and returns true. False, and the rest stays in the
  /// file, after two attempts that failed, or after one as soon as `is_stopped`.
  bool catch_up(const std::function<bool()>& is_stopped = {});

  /// Why the last attempt failed; none if it did not.
  [[nodiscard]] std::optional<Error> fault() const;

  /// Frames of the session that the server has.
  [[nodiscard]] std::int64_t saved_frames() const;

  /// How often an attempt succeeded after some that failed.
  [[nodiscard]] int reconnections() const;

  /// Sentences for the user that nobody has taken yet.
  std::vector<std::string> take_notices();

 private:
  void run();
  bool attempt();
  void copy_all();
  bool copy_some();
  void link();
  void make_changes();
  void note_change(const std::optional<Error>& fault);

  std::unique_ptr<MapDatabase> server_;
  Begun begun_;
  std::string queue_;
  std::unique_ptr<QueuedRows> rows_;  ///< for the thread only, like the next two
  bool is_sure_ = true;               ///< of what the server has
  std::size_t damage_ = 0;            ///< of the rows; so many clauses are in notices

  mutable std::mutex mutex_;  ///< guards all below
  std::condition_variable woken_;
  std::condition_variable tried_;
  std::vector<Change> changes_;
  std::vector<std::string> notices_;
  std::optional<Error> fault_;
  std::int64_t wakes_ = 0;     ///< how often something was committed
  std::int64_t copied_ = 0;    ///< of these, how many the server has
  std::int64_t attempts_ = 0;  ///< that ended
  std::int64_t saved_frames_ = 0;
  int reconnections_ = 0;
  bool in_a_hurry_ = false;
  bool stop_ = false;
  std::thread thread_;  ///< last: it uses all the others
};

}  // namespace loopbit
