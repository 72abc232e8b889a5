// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "map_follower.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "server_limits.hpp"

namespace loopbit {
namespace {

/// A notification that was lost costs so much.
constexpr std::chrono::milliseconds kMaxSilence{1000};
/// Commits that are read at once; most have a few frames.
constexpr std::int64_t kEpochsAtOnce = 64;
/// 37 MB of contents. A caller that takes nothing gets no more.
constexpr std::size_t kMaxPlaces = 65536;

template <typename Row>
void append(std::vector<Row>& rows, std::vector<Row>&& more) {
  rows.insert(rows.end(), std::move_iterator(more.begin()), std::move_iterator(more.end()));
}

}  // namespace

MapFollower::MapFollower(std::unique_ptr<MapDatabase> database, int session, std::int64_t epoch,
                         std::set<int> known, std::function<void(const MapSession&)> check)
    : database_(std::move(database)),
      session_(session),
      known_(std::move(known)),
      check_(std::move(check)),
      epoch_(epoch) {
  database_->set_time_limit(kMaxAnswer);
  news_.epoch = epoch;
  thread_ = std::thread([this] { run(); });
}

MapFollower::~MapFollower() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  database_->interrupt();
  changed_.notify_all();
  thread_.join();
}

MapFollower::News MapFollower::take() {
  const std::lock_guard lock(mutex_);
  changed_.notify_all();
  return std::exchange(news_, {.epoch = news_.epoch});
}

bool MapFollower::has_stopped() const {
  const std::lock_guard lock(mutex_);
  return stop_;
}

void MapFollower::run() {
  RetryPause pause;
  while (!has_stopped()) {
    try {
      if (database_->is_lost()) database_->reconnect();
      follow();
      pause.reset();
      note({});
    } catch (const std::exception& error) {  // also if there is no memory
      note(error.what());
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, pause.next(), [this] { return stop_; });
    }
  }
}

/// How an attempt ended, if it is another way than the last one.
void MapFollower::note(const std::optional<std::string>& fault) {
  if (std::exchange(is_lost_, fault.has_value()) == fault.has_value()) return;
  const std::lock_guard lock(mutex_);
  news_.notices.push_back(
      fault ? fmt::format("Places of '{}' that were not read are no matches until it answers: {}",
                          database_->path(), *fault)
            : fmt::format("'{}' answers again.", database_->path()));
}

/// Once. Throws Error if the server is lost.
void MapFollower::follow() {
  database_->wait_for_commit(kMaxSilence);
  const std::int64_t last = database_->epoch();
  while (epoch_ < last) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return stop_ || news_.places.size() < kMaxPlaces; });
      if (stop_) return;
    }
    read(std::min(last, epoch_ + kEpochsAtOnce));
  }
}

/// What was committed up to `epoch`.
void MapFollower::read(std::int64_t epoch) {
  const EpochRange epochs{epoch_, epoch};
  News news;
  for_each_new_place(
      *database_, epochs,
      [&](const MapPlace& place) {
        if (is_of_use(place.at.session)) news.places.push_back(place);
      },
      damage_);
  const auto by_others = [this](std::vector<MapLoop> loops) {
    std::erase_if(loops, [this](const MapLoop& loop) { return loop.query.session == session_; });
    return loops;
  };
  news.loops = by_others(read_new_loops(*database_, "loop", epochs, damage_));
  news.rejected = by_others(read_new_loops(*database_, "rejected", epochs, damage_));
  const std::lock_guard lock(mutex_);
  append(news_.places, std::move(news.places));
  append(news_.loops, std::move(news.loops));
  append(news_.rejected, std::move(news.rejected));
  epoch_ = news_.epoch = epoch;  // last: what fails is read again
}

/// Makes a session that was not known news at once. If reading fails afterwards, the next attempt
/// finds it known and would not tell of it.
bool MapFollower::is_of_use(int session) {
  if (session == session_ || ignored_.contains(session)) return false;
  if (known_.contains(session)) return true;
  for (const MapSession& found : read_sessions(*database_, damage_, {session, session})) {
    try {
      check_(found);
    } catch (const Error&) {
      break;
    }
    const std::lock_guard lock(mutex_);
    news_.sessions.push_back(found);
    known_.insert(session);
    return true;
  }
  ignored_.insert(session);
  return false;
}

}  // namespace loopbit
