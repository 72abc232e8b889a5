// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <utility>

#include "loopbit/error.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/read_ahead.hpp"

namespace loopbit {
namespace {

class PrefetchSource final : public ImageSource {
 public:
  PrefetchSource(std::unique_ptr<ImageSource> source, std::size_t depth)
      : source_(std::move(source)),
        size_(source_->size()),
        description_(source_->description()),
        frames_([this](Frame& frame) { return source_->next(frame); }, depth) {}

  bool next(Frame& frame) override { return frames_.next(frame); }

  bool skip() override {
    Frame frame;
    return next(frame);
  }

  [[nodiscard]] std::optional<std::size_t> size() const override { return size_; }
  [[nodiscard]] std::string description() const override { return description_; }

  [[nodiscard]] std::string early_end() const override {
    return frames_.is_at_end() ? source_->early_end() : "";
  }

 private:
  const std::unique_ptr<ImageSource> source_;  ///< the reader's alone once it runs
  const std::optional<std::size_t> size_;
  const std::string description_;
  ReadAhead<Frame> frames_;
};

}  // namespace

std::unique_ptr<ImageSource> prefetch(std::unique_ptr<ImageSource> source, std::size_t depth) {
  if (depth == 0) throw Error(ErrorKind::option, "depth is 0, but must be 1 frame or more.");
  return std::make_unique<PrefetchSource>(std::move(source), depth);
}

}  // namespace loopbit
