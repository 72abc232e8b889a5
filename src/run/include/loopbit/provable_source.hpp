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

/// A source that can be asked for a frame that a detector can use before a run of it replaces
/// another.
class ProvableSource final : public ImageSource {
 public:
  explicit ProvableSource(std::unique_ptr<ImageSource> source);

  /// Reads ahead, so that next() gives all the same, to the first frame that can be used, which it
  /// returns; valid until the next call of any function. Throws Error (kind input) that names
  /// `input` if none is left.
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
  std::deque<Frame> ahead_;  ///< read, and not given yet
};

}  // namespace loopbit
