// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/provable_source.hpp"

#include <cassert>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/gray_image.hpp"

namespace loopbit {
namespace {

/// Why no detector can use `frame`, or nothing.
std::string fault(const Frame& frame) {
  if (!frame.error.empty()) return frame.error;
  try {
    (void)gray_image(frame.image);
  } catch (const Error& error) {
    return fmt::format("'{}': {}", frame.name, error.what());
  }
  return {};
}

}  // namespace

ProvableSource::ProvableSource(std::unique_ptr<ImageSource> source) : source_(std::move(source)) {
  assert(source_);
}

const Frame& ProvableSource::prove(const std::string& input) {
  if (!ahead_.empty() && ahead_.back().error.empty()) return ahead_.back();
  for (Frame frame; source_->next(frame); frame = {}) {
    frame.error = fault(frame);
    if (!frame.error.empty()) frame.image.release();  // many may come before one that is usable
    ahead_.push_back(frame);
    if (frame.error.empty()) return ahead_.back();
  }
  throw Error(ErrorKind::input,
              fmt::format("None of the {} frames of '{}' can be used, so no earlier run is "
                          "replaced. {}",
                          ahead_.size(), input, ahead_.empty() ? "" : ahead_.front().error));
}

bool ProvableSource::next(Frame& frame) {
  if (ahead_.empty()) return source_->next(frame);
  frame = std::move(ahead_.front());
  ahead_.pop_front();
  return true;
}

bool ProvableSource::skip() {
  if (ahead_.empty()) return source_->skip();
  ahead_.pop_front();
  return true;
}

}  // namespace loopbit
