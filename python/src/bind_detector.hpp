// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <mutex>
#include <optional>

#include "loopbit/loop_detector.hpp"

#include "numpy_image.hpp"

namespace loopbit::python {

/// A LoopDetector that several Python threads may hold: one at a time uses it, and the GIL is free
/// meanwhile.
class SharedDetector {
 public:
  explicit SharedDetector(const LoopDetectorOptions& options) : detector_(options) {}

  Detection process(ImageArgument image, std::optional<double> timestamp_s, Evidence* evidence);
  [[nodiscard]] Detection query(ImageArgument image, std::optional<double> timestamp_s) const;
  Detection skip(std::optional<double> timestamp_s);
  [[nodiscard]] PlaceId size() const;
  [[nodiscard]] LoopDetectorOptions options() const;

  /// Calls use(detector) while nobody else may. The GIL must not be held: who waits for it while
  /// another waits for the detector would wait forever.
  template <typename Use>
  void exclusively(Use&& use) {
    const std::scoped_lock lock(mutex_);
    use(detector_);
  }

 private:
  /// A callback in the midst of a run may ask the detector that runs.
  mutable std::recursive_mutex mutex_;
  LoopDetector detector_;
};

}  // namespace loopbit::python
