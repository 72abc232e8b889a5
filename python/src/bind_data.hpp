// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <mutex>
#include <string>

#include "loopbit/run_input.hpp"

namespace loopbit::python {

/// An input that several Python threads may hold: one at a time reads, without the GIL.
class SharedSource : public RunInput {
 public:
  using RunInput::RunInput;

  // These must be called without the GIL: see SharedDetector.
  bool next(Frame& frame) override {
    const std::scoped_lock lock(mutex_);
    return RunInput::next(frame);
  }
  bool skip() override {
    const std::scoped_lock lock(mutex_);
    return RunInput::skip();
  }
  const Frame& prove() override {
    const std::scoped_lock lock(mutex_);
    return RunInput::prove();
  }
  [[nodiscard]] std::size_t taken() const override {
    const std::scoped_lock lock(mutex_);
    return RunInput::taken();
  }
  [[nodiscard]] std::string early_end() const override {
    const std::scoped_lock lock(mutex_);
    return RunInput::early_end();
  }

 private:
  mutable std::mutex mutex_;
};

}  // namespace loopbit::python
