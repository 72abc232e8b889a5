// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

namespace loopbit {

/// Depth images on disk, and to which images of a run they belong.
class DepthFolder {
 public:
  /// `folder`: of a TUM RGB-D sequence, whose depth.txt lists depth images with their times, or of
  /// depth images named like the images. For `units_per_m` see depth_in_metres(). Throws Error
  /// (kind input) if there is none of them or depth.txt is malformed.
  DepthFolder(const std::string& folder, double units_per_m);

  /// Throws Error (kind input) if the first depth image cannot be read, is no depth, or has another
  /// shape than images of `size_px`.
  void check(cv::Size size_px) const;

  /// Metres for each pixel of the image `name` that was taken at `time_s`. Empty if it has no depth
  /// image (by time: none within 0.02 s), or one that check() would refuse.
  [[nodiscard]] cv::Mat1f depth_m(const std::string& name, std::optional<double> time_s,
                                  cv::Size size_px) const;

 private:
  [[nodiscard]] cv::Mat1f read(const std::filesystem::path& file, cv::Size size_px) const;

  double units_per_m_;
  std::map<std::string, std::filesystem::path> by_stem_;
  std::map<double, std::filesystem::path> by_time_s_;  ///< only of depth.txt
};

}  // namespace loopbit
