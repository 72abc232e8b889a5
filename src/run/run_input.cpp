// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/run_input.hpp"

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

RunInput::RunInput(std::unique_ptr<ImageSource> source, std::string input, const Sampling& sampling)
    : source_(std::move(source)), input_(std::move(input)), sampling_(sampling) {
  assert(source_);
}

const Frame& RunInput::prove() {
  if (!ahead_.empty() && ahead_.back().error.empty()) return ahead_.back();
  for (Frame frame; source_->next(frame); frame = {}) {
    frame.error = fault(frame);
    if (!frame.error.empty()) frame.image.release();  // many may come before one that is usable
    ahead_.push_back(frame);
    if (frame.error.empty()) return ahead_.back();
  }
  throw Error(ErrorKind::input,
              fmt::format("No frame of '{}' can be used, so no earlier run is replaced. {}", input_,
                          ahead_.empty() ? "" : ahead_.front().error));
}

bool RunInput::next(Frame& frame) {
  if (ahead_.empty()) {
    if (!source_->next(frame)) return false;
  } else {
    frame = std::move(ahead_.front());
    ahead_.pop_front();
  }
  ++taken_;
  return true;
}

bool RunInput::skip() {
  if (ahead_.empty()) {
    if (!source_->skip()) return false;
  } else {
    ahead_.pop_front();
  }
  ++taken_;
  return true;
}

}  // namespace loopbit
