// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "loopbit/error.hpp"
#include "loopbit/image_source.hpp"

namespace loopbit {
namespace {

/// Frames wait in a queue of bounded length, filled by one thread and emptied by the caller.
class PrefetchSource final : public ImageSource {
 public:
  PrefetchSource(std::unique_ptr<ImageSource> source, std::size_t depth)
      : source_(std::move(source)),
        size_(source_->size()),
        description_(source_->description()),
        depth_(depth) {}

  PrefetchSource(const PrefetchSource&) = delete;
  PrefetchSource& operator=(const PrefetchSource&) = delete;
  PrefetchSource(PrefetchSource&&) = delete;
  PrefetchSource& operator=(PrefetchSource&&) = delete;

  ~PrefetchSource() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    if (reader_.joinable()) reader_.join();
  }

  bool next(Frame& frame) override {
    if (!reader_.joinable()) reader_ = std::thread([this] { read_all(); });
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !queue_.empty() || ended_; });
    if (queue_.empty()) {
      if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
      return false;
    }
    frame = std::move(queue_.front());
    queue_.pop_front();
    changed_.notify_all();
    return true;
  }

  bool skip() override {
    Frame frame;
    return next(frame);
  }

  [[nodiscard]] std::optional<std::size_t> size() const override { return size_; }
  [[nodiscard]] std::string description() const override { return description_; }

  [[nodiscard]] std::string early_end() const override {
    const std::lock_guard lock(mutex_);
    return ended_ && queue_.empty() ? source_->early_end() : "";
  }

 private:
  void read_all() {
    try {
      Frame frame;
      while (source_->next(frame) && push(std::move(frame))) frame = {};
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }

  bool push(Frame frame) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return queue_.size() < depth_ || stop_; });
    if (stop_) return false;
    queue_.push_back(std::move(frame));
    changed_.notify_all();
    return true;
  }

  const std::unique_ptr<ImageSource> source_;  ///< the reader's alone once it runs
  const std::optional<std::size_t> size_;
  const std::string description_;
  const std::size_t depth_;

  mutable std::mutex mutex_;  ///< guards what follows
  std::condition_variable changed_;
  std::deque<Frame> queue_;
  std::exception_ptr failure_;
  bool ended_ = false;
  bool stop_ = false;

  std::thread reader_;  ///< begins with the first frame that is asked for
};

}  // namespace

std::unique_ptr<ImageSource> prefetch(std::unique_ptr<ImageSource> source, std::size_t depth) {
  if (depth == 0) throw Error(ErrorKind::option, "depth is 0, but must be 1 frame or more.");
  return std::make_unique<PrefetchSource>(std::move(source), depth);
}

}  // namespace loopbit
