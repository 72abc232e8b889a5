// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "loopbit/image_source.hpp"

namespace loopbit {

/// A source that can check that it has a usable frame, before a run of it replaces another run.
class ProvableSource final : public ImageSource {
 public:
  explicit ProvableSource(std::unique_ptr<ImageSource> source);

  /// Reads ahead to the first usable frame and returns it. next() still returns all frames. The
  /// reference is valid until the next call of any function. Throws Error (kind input) with `input`
  /// if there is none.
  const Frame& prove(const std::string& input);

  bool next(Frame& frame) override;
  bool skip() override;
  [[nodiscard]] std::optional<std::size_t> size() const override { return source_->size(); }
  [[nodiscard]] std::string description() const override { return source_->description(); }
  [[nodiscard]] std::string early_end() const override {
    return ahead_.empty() ? source_->early_end() : "";
  }

 private:
  std::unique_ptr<ImageSource> source_;
  std::deque<Frame> ahead_;  ///< read, but not yet returned
};

}  // namespace loopbit
