// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
//
// Loop closure in a keyframe SLAM. The tracker passes its keyframes on and continues. A separate
// thread finds the loops and passes them to the back end. Here the "tracker" takes every third
// image of a sequence as a keyframe, and the "back end" prints the edges that it would add to its
// pose graph or remove from it.
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

/// What the back end does with a loop. Called from the worker thread.
struct BackEnd {
  std::function<void(KeyframeId query, KeyframeId match, double score)> add_edge;
  std::function<void(KeyframeId query, KeyframeId match)> remove_edge;
};

/// Finds loops among keyframes in the order in which they are added. add() does not wait for the
/// detection.
class LoopCloser {
 public:
  explicit LoopCloser(BackEnd back_end)
      : back_end_(std::move(back_end)), thread_([this] { work(); }) {}

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
    const auto id_of = [&](loopbit::PlaceId frame) {
      return ids_[static_cast<std::size_t>(frame)];
    };
    if (found.status == loopbit::Status::loop) {
      back_end_.add_edge(keyframe.id, id_of(*found.match), found.score);
    }
    // Loops of the keyframes just before, found only now.
    for (const loopbit::LateLoop& loop : found.late_loops) {
      back_end_.add_edge(id_of(loop.frame), id_of(*loop.match), loop.score);
    }
    // Loops that are now more likely wrong than right.
    for (const loopbit::LateLoop& loop : found.withdrawn_loops) {
      back_end_.remove_edge(id_of(loop.frame), id_of(*loop.match));
    }
  }

  BackEnd back_end_;
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
  LoopCloser closer({.add_edge =
                         [](KeyframeId query, KeyframeId match, double score) {
                           std::cout << "edge " << query << " -> " << match << ", score " << score
                                     << '\n';
                         },
                     .remove_edge =
                         [](KeyframeId query, KeyframeId match) {
                           std::cout << "no edge " << query << " -> " << match << '\n';
                         }});
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
