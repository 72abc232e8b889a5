// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "features_ahead.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "loopbit/error.hpp"

#include "map_rows.hpp"
#include "server_limits.hpp"

namespace loopbit {
namespace {

/// 5 MB of features. A robot may follow several sessions at once.
constexpr std::size_t kMaxBlocks = 16;
constexpr std::size_t kMaxRecent = 16;

}  // namespace

FeaturesAhead::FeaturesAhead(std::unique_ptr<MapDatabase> database)
    : database_(std::move(database)) {
  database_->set_time_limit(kMaxAnswer);
  thread_ = std::thread([this] { run(); });
}

FeaturesAhead::~FeaturesAhead() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  database_->interrupt();
  wanted_.notify_all();
  thread_.join();
}

std::shared_ptr<const Features> FeaturesAhead::take(std::int64_t place,
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

FeaturesAhead::Block* FeaturesAhead::find(std::int64_t number) {
  const auto found = std::ranges::find(blocks_, number, &Block::number);
  return found == blocks_.end() ? nullptr : &*found;
}

/// If the robot was close to `place` before, it goes on in the same direction.
void FeaturesAhead::want_around(std::int64_t place) {
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

void FeaturesAhead::want(std::int64_t number) {
  if (find(number)) return;
  blocks_.push_back({.number = number});
  if (blocks_.size() > kMaxBlocks) blocks_.pop_front();
  wanted_.notify_all();
}

void FeaturesAhead::run() {
  RetryPause pause;
  std::unique_lock lock(mutex_);
  while (!stop_) {
    try {
      read_next(lock);
      pause.reset();
    } catch (const Error&) {  // the upload says so
      lock.lock();
      is_away_ = true;
      std::erase_if(blocks_, [](const Block& block) { return !block.is_read; });
      read_.notify_all();
      wanted_.wait_for(lock, pause.next(), [this] { return stop_; });
    }
  }
}

/// Throws Error, and the lock is not held, if the server is lost.
void FeaturesAhead::read_next(std::unique_lock<std::mutex>& lock) {
  const auto is_unread = [](const Block& block) { return !block.is_read; };
  const auto next = [&] { return std::ranges::find_if(blocks_, is_unread); };
  wanted_.wait(lock, [&] { return stop_ || is_away_ || next() != blocks_.end(); });
  if (stop_) return;
  Block read{.number = is_away_ ? 0 : next()->number, .is_read = true};
  lock.unlock();
  if (database_->is_lost()) database_->reconnect();
  const std::int64_t first = read.number * kBlock;
  for_each_features(*database_, {first, first + kBlock - 1},
                    [&](std::int64_t key, Features features) {
                      read.features.at(static_cast<std::size_t>(key - first)) =
                          std::make_shared<const Features>(std::move(features));
                    });
  lock.lock();
  is_away_ = false;
  if (Block* const block = find(read.number)) *block = std::move(read);
  read_.notify_all();
}

}  // namespace loopbit
