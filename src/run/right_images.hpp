// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include <opencv2/core.hpp>

#include "loopbit/camera.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

/// The second camera of a stereo pair.
struct RightCamera {
  CameraModel camera;
  cv::Matx44d T_left_right = cv::Matx44d::eye();  ///< from its frame to that of the first, metres
};

/// The camera of the images in `folder` and where it stands. `left`: that of the run's images, from
/// `left_file`. With `baseline_m` above 0, the pair is rectified, and the camera is as `left`, so
/// far to the right of it. Otherwise find_camera(folder) tells, or the second camera of
/// `left_file`. Throws Error (kind input) if none of them does.
RightCamera right_camera(const std::string& folder, double baseline_m, const CameraModel& left,
                         const std::string& left_file);

/// The images of a second camera on disk, named like those of the first.
class RightImages {
 public:
  /// Reads the first image, to check it. Throws Error (kind input) if there are no images, or it
  /// cannot be read or does not fit the camera.
  RightImages(const std::string& folder, const RightCamera& right, const SurfOptions& options);

  /// The features of the image that belongs to the image `name` of the first camera. Empty if there
  /// is none, or none that can be read.
  [[nodiscard]] Features features_of(const std::string& name);

  [[nodiscard]] const RightCamera& camera() const { return right_; }

 private:
  RightCamera right_;
  std::map<std::string, std::filesystem::path> by_stem_;
  SurfExtractor surf_;
};

}  // namespace loopbit
