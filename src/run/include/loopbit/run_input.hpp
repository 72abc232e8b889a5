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

/// An input that was opened for a run: its frames, how they were chosen, how many were taken, and
/// whether one of them is usable.
class RunInput : public ImageSource {
 public:
  /// `source`: the frames of `input` that `sampling` leaves. An input that open_source() does not
  /// know may have any name.
  explicit RunInput(std::unique_ptr<ImageSource> source, std::string input,
                    const Sampling& sampling = {});

  /// Reads ahead to the first usable frame and returns it. next() still returns all frames. The
  /// reference is valid until the next call of any function. Throws Error (kind input) if there is
  /// none.
  virtual const Frame& prove();

  bool next(Frame& frame) override;
  bool skip() override;
  [[nodiscard]] std::optional<std::size_t> size() const override { return source_->size(); }
  [[nodiscard]] std::string description() const override { return source_->description(); }
  [[nodiscard]] std::string early_end() const override {
    return ahead_.empty() ? source_->early_end() : "";
  }

  /// How many frames next() and skip() gave.
  [[nodiscard]] virtual std::size_t taken() const { return taken_; }
  [[nodiscard]] const std::string& input() const { return input_; }
  [[nodiscard]] const Sampling& sampling() const { return sampling_; }

 private:
  std::unique_ptr<ImageSource> source_;
  std::string input_;
  Sampling sampling_;
  std::deque<Frame> ahead_;  ///< read, but not yet returned
  std::size_t taken_ = 0;
};

}  // namespace loopbit
