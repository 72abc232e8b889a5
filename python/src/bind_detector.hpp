// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "loopbit/loop_detector.hpp"

#include "numpy_image.hpp"
#include "numpy_matrix.hpp"
#include "place_argument.hpp"
#include "shared_map.hpp"

namespace loopbit::python {

/// A LoopDetector that several Python threads may share. It serves one at a time and releases the
/// GIL.
class SharedDetector {
 public:
  /// Without options, uses those of the map, or the defaults. Throws Error (kind option) if the map
  /// was made with other settings of binary_content or surf. Call it without the GIL.
  SharedDetector(const std::optional<LoopDetectorOptions>& options,
                 const std::shared_ptr<SharedMap>& map);

  Detection process(ImageArgument image, std::optional<double> timestamp_s, Evidence* evidence,
                    const AllowedArgument& allowed, const std::optional<MatrixArgument>& odometry,
                    const std::optional<MatrixArgument>& odometry_covariance);
  /// Fills `ranking` and `evidence` unless they are null.
  [[nodiscard]] Detection query(ImageArgument image, std::optional<double> timestamp_s,
                                std::vector<RankedPlace>* ranking, Evidence* evidence,
                                const AllowedArgument& allowed) const;
  void set_mask(const std::optional<ImageArgument>& mask);
  void set_camera(const std::optional<CameraModel>& camera);
  Detection skip(std::optional<double> timestamp_s, const std::optional<MatrixArgument>& odometry,
                 const std::optional<MatrixArgument>& odometry_covariance);
  void remove(const PlaceArgument& place);
  void reject(const QueryArgument& query, const std::optional<PlaceArgument>& match);
  [[nodiscard]] Features features_of(const PlaceArgument& place) const;
  [[nodiscard]] PlaceId size() const;
  [[nodiscard]] LoopDetectorOptions options() const;

  /// Calls use(detector) exclusively. Do not hold the GIL: two threads that wait for the GIL and
  /// for the detector would deadlock.
  template <typename Use>
  void exclusively(Use&& use) {
    const std::scoped_lock lock(mutex_);
    use(detector_);
  }

 private:
  /// Recursive, because a callback during a run may query the detector.
  mutable std::recursive_mutex mutex_;
  mutable bool is_answering_ = false;  ///< a function `allowed` may then run in the same thread
  LoopDetector detector_;
};

}  // namespace loopbit::python
