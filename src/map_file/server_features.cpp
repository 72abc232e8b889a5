// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "server_features.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <iterator>
#include <utility>

#include "loopbit/error.hpp"

#include "server_limits.hpp"

namespace loopbit {
namespace {

/// Places that are read by one statement.
constexpr std::int64_t kBlock = 4;
/// 5 MB of features. A robot may follow several sessions at once.
constexpr std::size_t kMaxBlocks = 32;
/// Of so many places the caller has the features: its cache holds 1,500 by default.
constexpr std::size_t kMaxAsked = 1024;
/// A path goes on from one of so many places, those of about three frames.
constexpr std::ptrdiff_t kMaxRecent = 32;
constexpr std::int64_t kMaxStep = 2;

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
  // The other thread drops the block if the server is lost.
  read_.wait_for(lock, most, [&] {
    const auto block = find(place);
    return block == blocks_.end() || block->is_read;
  });
  std::shared_ptr<const Features> features;
  if (const auto block = find(place); block != blocks_.end() && block->is_read) {
    features = std::exchange(block->features[static_cast<std::size_t>(place - block->first)], {});
    if (!features) blocks_.erase(block);  // it was added since
  }
  want_after(place);
  return features;
}

/// The block with a place.
std::deque<ServerFeatures::Block>::iterator ServerFeatures::find(std::int64_t place) {
  return std::ranges::find_if(blocks_, [&](const Block& block) {
    return block.first <= place && place < block.first + std::ssize(block.features);
  });
}

/// If the robot was close to `place` just before, it goes on in the same direction.
void ServerFeatures::want_after(std::int64_t place) {
  const auto end = asked_.rbegin() + std::min(std::ssize(asked_), kMaxRecent);
  const auto found = std::find_if(asked_.rbegin(), end, [&](std::int64_t each) {
    return each != place && std::abs(each - place) <= kMaxStep;
  });
  const std::int64_t before = found == end ? place : *found;
  asked_.push_back(place);
  if (asked_.size() > kMaxAsked) asked_.pop_front();
  if (before == place || is_away_) return;
  const std::int64_t step = before < place ? 1 : -1;
  std::int64_t last = place;
  while (std::abs(last - place) < kBlock && find(last + step) == blocks_.end() &&
         std::ranges::find(asked_, last + step) == asked_.end()) {
    last += step;
  }
  if (last == place) return;
  blocks_.push_back({.first = std::min(place + step, last)});
  blocks_.back().features.resize(static_cast<std::size_t>(std::abs(last - place)));
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
    } catch (const std::exception&) {  // the upload or the follower says so
      if (!lock.owns_lock()) lock.lock();
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

// The two throw, with or without the lock, if the server is lost or there is no memory.

void ServerFeatures::reach_again(std::unique_lock<std::mutex>& lock) {
  lock.unlock();
  database_.set_time_limit(kMaxAnswer);
  database_.reconnect();
  lock.lock();
  is_lost_ = false;
}

/// If the server was away, no block, to see whether it is back.
void ServerFeatures::read_next(std::unique_lock<std::mutex>& lock) {
  Block read = is_away_ ? Block{} : *unread();
  lock.unlock();
  if (ahead_->is_lost()) ahead_->reconnect();
  const KeyRange keys{read.first, read.first + std::ssize(read.features) - 1};
  for_each_features(*ahead_, keys, [&](std::int64_t key, Features features) {
    read.features[static_cast<std::size_t>(key - read.first)] =
        std::make_shared<const Features>(std::move(features));
  });
  read.is_read = true;
  lock.lock();
  is_away_ = false;
  if (const auto block = find(read.first); block != blocks_.end()) *block = std::move(read);
  read_.notify_all();
}

}  // namespace loopbit
