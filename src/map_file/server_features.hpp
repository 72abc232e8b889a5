// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "loopbit/map_database.hpp"
#include "loopbit/surf.hpp"

#include "map_rows.hpp"

namespace loopbit {

/// The features of places on a server. A thread of its own reads those that a robot will ask for:
/// when it follows an earlier session, those of the next places along it. It also reaches the
/// server again. One other thread may call it.
class ServerFeatures {
 public:
  /// `ahead`: a connection for the thread. `database`: one for the caller, which must outlive this.
  ServerFeatures(std::unique_ptr<MapDatabase> ahead, MapDatabase& database);
  /// Stops at once, whatever the server does.
  ~ServerFeatures();
  ServerFeatures(const ServerFeatures&) = delete;
  ServerFeatures& operator=(const ServerFeatures&) = delete;
  ServerFeatures(ServerFeatures&&) = delete;
  ServerFeatures& operator=(ServerFeatures&&) = delete;

  /// Those of the place with the key `place`, which is place `at`; the caller keeps them. Empty,
  /// with a clause in `damage`, if they are damaged. Null if the server does not give them within
  /// `most`.
  std::shared_ptr<const Features> take(std::int64_t place, const SessionFrame& at,
                                       std::chrono::nanoseconds most, Damage& damage);

 private:
  /// Successive places.
  struct Block {
    std::int64_t first = 0;
    bool is_read = false;
    std::vector<std::shared_ptr<const Features>> features = {};  ///< null: none, or taken
  };

  std::shared_ptr<const Features> take_read(std::int64_t place, std::chrono::nanoseconds most);
  void run();
  void reach_again(std::unique_lock<std::mutex>& lock);
  void read_next(std::unique_lock<std::mutex>& lock);
  [[nodiscard]] std::deque<Block>::iterator unread();
  [[nodiscard]] std::deque<Block>::iterator find(std::int64_t place);
  void want_after(std::int64_t place);

  std::unique_ptr<MapDatabase> ahead_;
  MapDatabase& database_;
  FeatureReader reader_;  ///< of database_

  std::mutex mutex_;  ///< guards all below
  std::condition_variable wanted_;
  std::condition_variable read_;
  std::deque<Block> blocks_;        ///< the newest last
  std::deque<std::int64_t> asked_;  ///< places that were taken, the newest last
  bool is_away_ = false;            ///< the server, from ahead_
  bool is_lost_ = false;            ///< the server, from database_, which only the thread then uses
  bool stop_ = false;
  std::thread thread_;  ///< last: it uses all the others
};

}  // namespace loopbit
