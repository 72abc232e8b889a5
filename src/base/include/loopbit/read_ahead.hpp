// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace loopbit {

/// Reads items in a thread of its own, from the first one that is asked for, while the caller works
/// on those before. They wait in a queue.
template <typename Item>
class ReadAhead {
 public:
  /// `read(item)` fills `item`, or returns false at the end. At most `depth` items wait.
  ReadAhead(std::function<bool(Item&)> read, std::size_t depth)
      : read_(std::move(read)), depth_(depth) {}

  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;
  ReadAhead(ReadAhead&&) = delete;
  ReadAhead& operator=(ReadAhead&&) = delete;

  /// Waits for the item that is being read.
  ~ReadAhead() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    if (reader_.joinable()) reader_.join();
  }

  /// The next item, or false at the end. What `read` throws comes in its place, and then the end.
  bool next(Item& item) {
    if (!reader_.joinable()) reader_ = std::thread([this] { read_all(); });
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !queue_.empty() || ended_; });
    if (queue_.empty()) {
      if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
      return false;
    }
    item = std::move(queue_.front());
    queue_.pop_front();
    changed_.notify_all();
    return true;
  }

  /// Whether next() has given all, so that `read` is not called any more.
  [[nodiscard]] bool is_at_end() const {
    const std::lock_guard lock(mutex_);
    return ended_ && queue_.empty();
  }

 private:
  void read_all() {
    try {
      Item item;
      while (read_(item) && push(std::move(item))) item = {};
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }

  bool push(Item item) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return queue_.size() < depth_ || stop_; });
    if (stop_) return false;
    queue_.push_back(std::move(item));
    changed_.notify_all();
    return true;
  }

  const std::function<bool(Item&)> read_;  ///< the reader's alone
  const std::size_t depth_;

  mutable std::mutex mutex_;  ///< guards what follows
  std::condition_variable changed_;
  std::deque<Item> queue_;
  std::exception_ptr failure_;
  bool ended_ = false;
  bool stop_ = false;

  std::thread reader_;
};

}  // namespace loopbit
