// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>

#include "loopbit/map_database.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

/// Reads the features that a robot will ask a server for, on a thread of its own: when it follows
/// an earlier session, those of the next places along it. While the server is lost, there are none.
/// One other thread may call it.
class FeaturesAhead {
 public:
  explicit FeaturesAhead(std::unique_ptr<MapDatabase> database);
  /// Stops at once, whatever the server does.
  ~FeaturesAhead();
  FeaturesAhead(const FeaturesAhead&) = delete;
  FeaturesAhead& operator=(const FeaturesAhead&) = delete;
  FeaturesAhead(FeaturesAhead&&) = delete;
  FeaturesAhead& operator=(FeaturesAhead&&) = delete;

  /// Those of the place with the key `place`, which the caller keeps. Null if they were not read;
  /// waits at most so long while they are. Call this for each place that the server is asked for.
  std::shared_ptr<const Features> take(std::int64_t place, std::chrono::nanoseconds most);

 private:
  /// Places that are read by one statement.
  static constexpr std::int64_t kBlock = 8;
  struct Block {
    std::int64_t number;  ///< key / kBlock
    bool is_read = false;
    std::array<std::shared_ptr<const Features>, kBlock> features = {};  ///< null: none, or taken
  };

  void run();
  void read_next(std::unique_lock<std::mutex>& lock);
  [[nodiscard]] Block* find(std::int64_t number);
  void want_around(std::int64_t place);
  void want(std::int64_t number);

  std::unique_ptr<MapDatabase> database_;

  std::mutex mutex_;  ///< guards all below
  std::condition_variable wanted_;
  std::condition_variable read_;
  std::deque<Block> blocks_;         ///< the newest last
  std::deque<std::int64_t> recent_;  ///< places that were asked for, the newest last
  bool is_away_ = false;             ///< the server
  bool stop_ = false;
  std::thread thread_;  ///< last: it uses all the others
};

}  // namespace loopbit
