// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/provable_source.hpp"

#include <cassert>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {

ProvableSource::ProvableSource(std::unique_ptr<ImageSource> source) : source_(std::move(source)) {
  assert(source_);
}

void ProvableSource::prove(const std::string& input) {
  if (!ahead_.empty() && ahead_.back().error.empty()) return;
  for (Frame frame; source_->next(frame); frame = {}) {
    ahead_.push_back(frame);
    if (frame.error.empty()) return;
  }
  throw Error(ErrorKind::input,
              fmt::format("None of the {} frames of '{}' could be read, so no earlier run is "
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
