// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "loopbit/image_source.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/provable_source.hpp"
#include "loopbit/runner.hpp"

namespace loopbit::python {

/// An ImageSource that several Python threads may hold: one at a time reads, without the GIL.
class SharedSource : public ImageSource {
 public:
  /// `input`, `every` and `limit`: how it was opened, for run.json.
  explicit SharedSource(std::unique_ptr<ImageSource> source, std::string input, int every = 1,
                        int limit = 0)
      : input_(std::move(input)), every_(every), limit_(limit), source_(std::move(source)) {}

  // These must be called without the GIL: see SharedDetector.
  bool next(Frame& frame) override {
    const std::scoped_lock lock(mutex_);
    return counted(source_.next(frame));
  }
  bool skip() override {
    const std::scoped_lock lock(mutex_);
    return counted(source_.skip());
  }
  /// See ProvableSource and check_time.
  void prove(const LoopDetectorOptions& options) {
    const std::scoped_lock lock(mutex_);
    check_time(source_.prove(input_), options);
  }

  [[nodiscard]] std::size_t frames_taken() {
    const std::scoped_lock lock(mutex_);
    return taken_;
  }
  /// How many frames are still to come, where that is sure.
  [[nodiscard]] std::optional<std::size_t> frames_left() {
    const std::scoped_lock lock(mutex_);
    const auto frames = exact_size(source_, input_);
    return frames ? std::optional(*frames - taken_) : std::nullopt;
  }

  [[nodiscard]] std::optional<std::size_t> size() const override { return source_.size(); }
  [[nodiscard]] std::string description() const override { return source_.description(); }
  [[nodiscard]] std::string early_end() const override {
    const std::scoped_lock lock(mutex_);
    return source_.early_end();
  }
  [[nodiscard]] const std::string& input() const { return input_; }
  [[nodiscard]] int every() const { return every_; }
  [[nodiscard]] int limit() const { return limit_; }

 private:
  bool counted(bool is_there) {
    if (is_there) ++taken_;
    return is_there;
  }

  std::string input_;
  int every_;
  int limit_;
  mutable std::mutex mutex_;
  std::size_t taken_ = 0;
  ProvableSource source_;
};

}  // namespace loopbit::python
