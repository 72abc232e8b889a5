// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// A run on images that come as a camera's do, for live_test.mjs:
//
//   live_run IMAGES OUT FRAMES_PER_S BUFFERS [live]
//
// Frames that the run takes too late for so many BUFFERS are lost; drivers of cameras (V4L2)
// usually have four. With `live` it serves the live page, prints its URL and waits for a line on
// stdin, before the first frame and before the last tenth. At last it prints a line of JSON.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>
#include <sys/resource.h>

#include "loopbit/finished_run.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/live_page.hpp"
#include "loopbit/record_run.hpp"
#include "loopbit/report.hpp"

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::duration;

/// Gives the frames at a rate, as a camera with some buffers does: if the run takes them too late,
/// they are lost.
class Camera final : public loopbit::ImageSource {
 public:
  /// `wait`: called before the first frame and before the last tenth.
  Camera(std::unique_ptr<loopbit::ImageSource> images, double rate, int buffers,
         std::function<void()> wait)
      : images_(std::move(images)),
        period_(1.0 / rate),
        buffers_(buffers),
        wait_(std::move(wait)) {}

  bool next(loopbit::Frame& frame) override {
    auto asked = Clock::now();
    if (taken_ > 0) busy_ += asked - given_;
    if (taken_ >= next_wait_) {
      next_wait_ = taken_ == 0 ? static_cast<int>(*images_->size()) * 9 / 10
                               : std::numeric_limits<int>::max();
      wait_();
      asked = Clock::now();
      start_ = asked - std::chrono::duration_cast<Clock::duration>(taken_ * period_);
    }
    while (asked - start_ > (taken_ + buffers_) * period_ && images_->skip()) {
      ++taken_;
      ++dropped_;
    }
    std::this_thread::sleep_until(start_ +
                                  std::chrono::duration_cast<Clock::duration>(taken_ * period_));
    ++taken_;
    const bool is_there = images_->next(frame);
    given_ = Clock::now();
    return is_there;
  }
  bool skip() override { return images_->skip(); }
  [[nodiscard]] std::optional<std::size_t> size() const override { return images_->size(); }
  [[nodiscard]] std::string description() const override { return "a camera"; }

  [[nodiscard]] int dropped() const { return dropped_; }
  /// From giving a frame to the request for the next.
  [[nodiscard]] double busy_ms() const {
    return duration<double, std::milli>(busy_).count() / std::max(1, taken_ - 1);
  }

 private:
  std::unique_ptr<loopbit::ImageSource> images_;
  duration<double> period_;
  int buffers_;
  std::function<void()> wait_;
  Clock::time_point start_;
  Clock::time_point given_;
  Clock::duration busy_{0};
  int taken_ = 0;
  int next_wait_ = 0;  ///< after so many frames
  int dropped_ = 0;
};

double cpu_ms() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto ms = [](const timeval& time) {
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec);
  };
  return ms(usage.ru_utime) + ms(usage.ru_stime);
}

int run(const std::string& images, const std::string& folder, double rate, int buffers,
        bool is_live) {
  std::unique_ptr<loopbit::LivePage> page;
  if (is_live) {
    page = std::make_unique<loopbit::LivePage>(loopbit::LivePage::Options{.port = 0});
    std::cout << page->url() << std::endl;
  }
  double waited_ms = 0;  // of the processor
  const auto wait = [is_live, &waited_ms] {
    const double before_ms = cpu_ms();
    std::string line;
    if (is_live) std::getline(std::cin, line);
    waited_ms += cpu_ms() - before_ms;
  };
  cv::setNumThreads(1);
  auto camera = std::make_unique<Camera>(loopbit::open_source(images), rate, buffers, wait);
  const Camera& frames = *camera;
  loopbit::RunInput input(std::move(camera), images);
  const loopbit::RunListener listener{[](const auto&) {}, [](const auto&) {}};
  const double before_ms = cpu_ms();
  const std::atomic<bool> stop{false};
  const auto outcome =
      record_run(input, {.folder = folder}, page ? page->beside(listener) : listener, stop);
  const double used_ms = cpu_ms() - before_ms - waited_ms;
  const std::string report = folder + "/report.html";
  loopbit::write_report(report, {loopbit::to_report_run("live", loopbit::read_run(folder))});
  if (page) page->finish(report);
  const auto count = outcome.detections.size();
  std::cout << fmt::format(
                   R"({{"frames": {}, "dropped": {}, "busy_ms": {:.3f}, "cpu_ms": {:.3f}}})", count,
                   frames.dropped(), frames.busy_ms(), used_ms / static_cast<double>(count))
            << std::endl;
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) return 2;
  return run(argv[1], argv[2], std::atof(argv[3]), std::atoi(argv[4]), argc > 5);
}
