// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "loopbit/error.hpp"
#include "loopbit/map_database.hpp"
#include "loopbit/map_file.hpp"

#include "map_rows.hpp"

namespace loopbit {

/// Learns what others commit to a map on a server, on a thread of its own: whole commits, in the
/// order of their epochs. While the server is lost, there is nothing new. One other thread may call
/// it.
class MapFollower {
 public:
  /// Sessions that were not there in the beginning come before their places.
  struct News {
    std::int64_t epoch = 0;
    std::vector<MapSession> sessions = {};
    std::vector<MapPlace> places = {};
    std::vector<MapLoop> loops = {};
    std::vector<MapLoop> rejected = {};
    std::vector<std::string> notices = {};  ///< sentences: the server is lost, or it is back
  };

  /// `session`: of the caller, which is not news. `epoch`: what the caller knows. `known`:
  /// sessions. `check(session)` throws Error for one whose places are of no use.
  MapFollower(std::unique_ptr<MapDatabase> database, int session, std::int64_t epoch,
              std::set<int> known, std::function<void(const MapSession&)> check);
  /// Stops at once, whatever the server does.
  ~MapFollower();
  MapFollower(const MapFollower&) = delete;
  MapFollower& operator=(const MapFollower&) = delete;
  MapFollower(MapFollower&&) = delete;
  MapFollower& operator=(MapFollower&&) = delete;

  /// What is new since the last call. Never waits for the server.
  News take();

 private:
  void run();
  void follow();
  void read(std::int64_t epoch);
  void note(const std::optional<std::string>& fault);
  [[nodiscard]] bool is_of_use(int session);
  [[nodiscard]] bool has_stopped() const;

  std::unique_ptr<MapDatabase> database_;
  int session_;
  std::set<int> known_;
  std::set<int> ignored_;
  std::function<void(const MapSession&)> check_;
  std::int64_t epoch_;  ///< that was read
  bool is_lost_ = false;
  Damage damage_;  ///< map_check finds it, too

  mutable std::mutex mutex_;  ///< guards all below
  std::condition_variable changed_;
  News news_;
  bool stop_ = false;
  std::thread thread_;  ///< last: it uses all the others
};

}  // namespace loopbit
