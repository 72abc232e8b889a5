// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cassert>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/image_source.hpp"

namespace loopbit {
namespace {

class Subsample final : public ImageSource {
 public:
  Subsample(std::unique_ptr<ImageSource> source, const Sampling& sampling)
      : source_(std::move(source)),
        every_(static_cast<std::size_t>(sampling.every)),
        limit_(static_cast<std::size_t>(sampling.limit)) {}

  bool next(Frame& frame) override {
    if (!advance() || !source_->next(frame)) return false;
    ++taken_;
    return true;
  }

  bool skip() override {
    if (!advance() || !source_->skip()) return false;
    ++taken_;
    return true;
  }

  [[nodiscard]] std::optional<std::size_t> size() const override {
    const auto all = source_->size();
    if (!all) return std::nullopt;
    const std::size_t kept = *all / every_ + (*all % every_ != 0 ? 1 : 0);
    return limit_ == 0 ? kept : std::min(kept, limit_);
  }

  [[nodiscard]] std::string description() const override {
    std::string text = source_->description();
    if (every_ > 1) text += fmt::format(", 1 frame in {}", every_);
    if (limit_ > 0) text += fmt::format(", at most {} frames", limit_);
    return text;
  }

  [[nodiscard]] std::string early_end() const override { return source_->early_end(); }

 private:
  /// To the next frame that counts. Skips just before it is asked for, so that a camera is not
  /// waited for in vain.
  bool advance() {
    if (limit_ > 0 && taken_ == limit_) return false;
    if (taken_ == 0) return true;
    for (std::size_t i = 1; i < every_; ++i) {
      if (!source_->skip()) return false;
    }
    return true;
  }

  std::unique_ptr<ImageSource> source_;
  std::size_t every_;
  std::size_t limit_;
  std::size_t taken_ = 0;
};

}  // namespace

std::unique_ptr<ImageSource> subsample(std::unique_ptr<ImageSource> source,
                                       const Sampling& sampling) {
  assert(source);
  if (sampling.every < 1 || sampling.limit < 0) {
    throw Error(ErrorKind::option,
                fmt::format("every is {} and limit is {}, but every must be at least 1, and limit "
                            "0 (no limit) or more.",
                            sampling.every, sampling.limit));
  }
  return std::make_unique<Subsample>(std::move(source), sampling);
}

}  // namespace loopbit
