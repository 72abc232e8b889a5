// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/binary_content.hpp"
#include "loopbit/surf.hpp"

namespace loopbit {

/// What moves with the camera: the robot's bonnet or arm, dirt on the lens. It shows in every image
/// and would make all places look alike, so contents and features leave it out. It is found where
/// feature after feature stays at the same spot while the view changes.
class AttachedParts {
 public:
  void remove_from(BinaryContent& content) const;
  void remove_from(Features& features) const;

  /// Takes the memory that the next remember() needs, so that it does not throw.
  void reserve_next(const cv::Size& working_size_px);

  /// Notes a frame by its keypoints, before any were removed. One that shows the same view as the
  /// last one noted changes nothing: a camera that stands still has no attached parts. Another
  /// working size begins anew.
  void remember(const cv::Size& working_size_px, const std::vector<Keypoint>& keypoints);

 private:
  /// Bit k is set if view k, modulo 16, has a feature within 2 px.
  using Views = std::uint16_t;

  [[nodiscard]] std::size_t index_of(int x_px, int y_px) const;
  [[nodiscard]] Views views_at(const Keypoint& keypoint) const;
  [[nodiscard]] bool is_attached(const Keypoint& keypoint) const;
  [[nodiscard]] bool shows_last_view(const std::vector<Keypoint>& keypoints) const;
  void note(const std::vector<Keypoint>& keypoints);
  void find_parts(const std::vector<Keypoint>& keypoints);

  BinaryContent parts_;   ///< the pixels that show them
  BinaryContent beside_;  ///< those that may: the pixels around
  cv::Size size_px_;
  std::vector<Views> views_;  ///< of each pixel of the working image
  std::vector<Views> next_;   ///< for another working size
  int num_views_ = 0;
};

}  // namespace loopbit
