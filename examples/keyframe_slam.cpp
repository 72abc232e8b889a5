// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
//
// Loop closure in a keyframe SLAM. The tracker passes its keyframes on and continues. A separate
// thread finds the loops and passes them to the back end. Here the "tracker" takes every third
// image of a sequence as a keyframe, and the "back end" prints the edge that it would add to its
// pose graph.
//
//   keyframe_slam INPUT    INPUT as in `loopbit run`
#include <condition_variable>
#include <deque>
#include <functional>
#include <iostream>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <loopbit/error.hpp>
#include <loopbit/image_source.hpp>
#include <loopbit/loop_detector.hpp>
#include <opencv2/core.hpp>

namespace {

using KeyframeId = int;

struct Keyframe {
  KeyframeId id = 0;
  cv::Mat image;
};

/// Finds loops among keyframes in the order in which they are added. add() does not wait for the
/// detection. `on_loop(query, match, score)` is called from the worker thread.
class LoopCloser {
 public:
  using OnLoop = std::function<void(KeyframeId, KeyframeId, double)>;

  explicit LoopCloser(OnLoop on_loop) : on_loop_(std::move(on_loop)), thread_([this] { work(); }) {}

  /// Processes all keyframes that were added, then stops.
  ~LoopCloser() {
    {
      const std::scoped_lock lock(mutex_);
      is_done_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }
  LoopCloser(const LoopCloser&) = delete;
  LoopCloser& operator=(const LoopCloser&) = delete;
  LoopCloser(LoopCloser&&) = delete;
  LoopCloser& operator=(LoopCloser&&) = delete;

  void add(Keyframe keyframe) {
    {
      const std::scoped_lock lock(mutex_);
      waiting_.push_back(std::move(keyframe));
    }
    changed_.notify_one();
  }

 private:
  void work() {
    for (std::unique_lock lock(mutex_);;) {
      changed_.wait(lock, [this] { return is_done_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      const Keyframe keyframe = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      detect(keyframe);
      lock.lock();
    }
  }

  /// Reports and skips an unusable keyframe, so that frame numbers stay aligned.
  loopbit::Detection process(const Keyframe& keyframe) {
    try {
      return detector_.process(keyframe.image);
    } catch (const loopbit::Error& error) {
      std::cerr << "keyframe " << keyframe.id << ": " << error.what() << '\n';
      return detector_.skip();
    }
  }

  void detect(const Keyframe& keyframe) {
    const loopbit::Detection found = process(keyframe);
    // loopbit numbers frames 0, 1, 2, ...; the back end has its own ids.
    ids_.push_back(keyframe.id);
    if (found.status == loopbit::Status::loop) {
      on_loop_(keyframe.id, ids_[static_cast<std::size_t>(*found.match)], found.score);
    }
  }

  OnLoop on_loop_;
  loopbit::LoopDetector detector_;
  std::vector<KeyframeId> ids_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Keyframe> waiting_;
  bool is_done_ = false;
  std::thread thread_;
};

void run(const char* input) {
  constexpr KeyframeId kEvery = 3;
  LoopCloser closer([](KeyframeId query, KeyframeId match, double score) {
    std::cout << "edge " << query << " -> " << match << ", score " << score << '\n';
  });
  const auto source = loopbit::open_source(input);
  KeyframeId id = 0;
  for (loopbit::Frame frame; source->next(frame); ++id) {
    if (!frame.error.empty()) std::cerr << frame.error << '\n';
    if (id % kEvery == 0 && frame.error.empty()) closer.add({id, frame.image});
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: keyframe_slam INPUT\n";
    return 2;
  }
  try {
    run(argv[1]);
  } catch (const loopbit::Error& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
