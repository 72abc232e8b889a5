// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "server_features.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "loopbit/error.hpp"

#include "server_limits.hpp"

namespace loopbit {
namespace {

/// 5 MB of features. A robot may follow several sessions at once.
constexpr std::size_t kMaxBlocks = 16;
constexpr std::size_t kMaxRecent = 16;

}  // namespace

ServerFeatures::ServerFeatures(std::unique_ptr<MapDatabase> ahead, MapDatabase& database)
    : ahead_(std::move(ahead)), database_(database), reader_(database) {
  ahead_->set_time_limit(kMaxAnswer);
  thread_ = std::thread([this] { run(); });
}

ServerFeatures::~ServerFeatures() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  ahead_->interrupt();
  database_.interrupt();
  wanted_.notify_all();
  thread_.join();
}

std::shared_ptr<const Features> ServerFeatures::take(std::int64_t place, const SessionFrame& at,
                                                     std::chrono::nanoseconds most,
                                                     Damage& damage) {
  const auto begin = std::chrono::steady_clock::now();
  {
    const std::lock_guard lock(mutex_);
    if (is_lost_) return nullptr;
  }
  if (auto features = take_read(place, most)) return features;
  const auto left = most - (std::chrono::steady_clock::now() - begin);
  database_.set_time_limit(
      std::max(std::chrono::ceil<std::chrono::milliseconds>(left), std::chrono::milliseconds{1}));
  try {
    auto read = reader_.read(place, at, damage);
    return std::make_shared<const Features>(read ? std::move(*read) : Features{});
  } catch (const Error&) {
    const std::lock_guard lock(mutex_);
    is_lost_ = true;
    wanted_.notify_all();
    return nullptr;
  }
}

/// Null if they were not read; waits while they are.
std::shared_ptr<const Features> ServerFeatures::take_read(std::int64_t place,
                                                          std::chrono::nanoseconds most) {
  std::unique_lock lock(mutex_);
  const std::int64_t number = place / kBlock;
  // The other thread drops the block if the server is lost.
  read_.wait_for(lock, most, [&] {
    const Block* const block = find(number);
    return !block || block->is_read;
  });
  std::shared_ptr<const Features> features;
  if (Block* const block = find(number); block && block->is_read) {
    features = std::exchange(block->features.at(static_cast<std::size_t>(place % kBlock)), {});
    if (!features) {  // it was added since
      std::erase_if(blocks_, [&](const Block& each) { return each.number == number; });
    }
  }
  want_around(place);
  return features;
}

ServerFeatures::Block* ServerFeatures::find(std::int64_t number) {
  const auto found = std::ranges::find(blocks_, number, &Block::number);
  return found == blocks_.end() ? nullptr : &*found;
}

/// If the robot was close to `place` before, it goes on in the same direction.
void ServerFeatures::want_around(std::int64_t place) {
  const auto before = std::find_if(recent_.rbegin(), recent_.rend(), [&](std::int64_t each) {
    return each != place && std::abs(each - place) <= kBlock;
  });
  if (before != recent_.rend() && !is_away_) {
    want(place / kBlock);
    want((*before < place ? place + kBlock : place - kBlock) / kBlock);
  }
  recent_.push_back(place);
  if (recent_.size() > kMaxRecent) recent_.pop_front();
}

void ServerFeatures::want(std::int64_t number) {
  if (find(number)) return;
  blocks_.push_back({.number = number});
  if (blocks_.size() > kMaxBlocks) blocks_.pop_front();
  wanted_.notify_all();
}

void ServerFeatures::run() {
  RetryPause pause;
  std::unique_lock lock(mutex_);
  while (true) {
    wanted_.wait(lock,
                 [this] { return stop_ || is_lost_ || is_away_ || unread() != blocks_.end(); });
    if (stop_) return;
    try {
      if (is_lost_) {
        reach_again(lock);
      } else {
        read_next(lock);
      }
      pause.reset();
    } catch (const Error&) {  // the upload or the follower says so
      lock.lock();
      is_away_ = true;
      std::erase_if(blocks_, [](const Block& block) { return !block.is_read; });
      read_.notify_all();
      wanted_.wait_for(lock, pause.next(), [this] { return stop_; });
    }
  }
}

std::deque<ServerFeatures::Block>::iterator ServerFeatures::unread() {
  return std::ranges::find_if(blocks_, [](const Block& block) { return !block.is_read; });
}

// The two throw Error, and the lock is not held, if the server is lost.

void ServerFeatures::reach_again(std::unique_lock<std::mutex>& lock) {
  lock.unlock();
  database_.set_time_limit(kMaxAnswer);
  database_.reconnect();
  lock.lock();
  is_lost_ = false;
}

/// If the server was away, no block, to see whether it is back.
void ServerFeatures::read_next(std::unique_lock<std::mutex>& lock) {
  Block read{.number = is_away_ ? 0 : unread()->number, .is_read = true};
  lock.unlock();
  if (ahead_->is_lost()) ahead_->reconnect();
  const std::int64_t first = read.number * kBlock;
  for_each_features(*ahead_, {first, first + kBlock - 1}, [&](std::int64_t key, Features features) {
    read.features.at(static_cast<std::size_t>(key - first)) =
        std::make_shared<const Features>(std::move(features));
  });
  lock.lock();
  is_away_ = false;
  if (Block* const block = find(read.number)) *block = std::move(read);
  read_.notify_all();
}

}  // namespace loopbit
