// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "loopbit/loop_detector.hpp"

#include "numpy_image.hpp"
#include "shared_map.hpp"

namespace loopbit::python {

/// A LoopDetector that several Python threads may hold: one at a time uses it, and the GIL is free
/// meanwhile.
class SharedDetector {
 public:
  /// Without options, those of the map, or the defaults. Throws Error (kind option) if the map was
  /// made with others of binary_content or surf. To be called without the GIL.
  SharedDetector(const std::optional<LoopDetectorOptions>& options,
                 const std::shared_ptr<SharedMap>& map);

  Detection process(ImageArgument image, std::optional<double> timestamp_s, Evidence* evidence);
  [[nodiscard]] Detection query(ImageArgument image, std::optional<double> timestamp_s,
                                std::vector<RankedPlace>* ranking) const;
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
