// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/binary_content.hpp"
#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

namespace loopbit {

/// Whether a keypoint of one image is where it is in the other: on the robot itself, on dirt on the
/// lens or its rim, far away, or seen from the same place.
bool is_unmoved(const Keypoint& a, const Keypoint& b);

/// What moves with the camera: the robot's bonnet or arm, dirt on the lens. It shows in every image
/// and would make all places look alike, so contents and features leave it out. It is found where
/// feature after feature stays at the same spot while the view changes.
class AttachedParts {
 public:
  /// Of so many views at the beginning of a session, they are not known yet and left out of none.
  static constexpr int kFirstViews = 4;

  void remove_from(BinaryContent& content) const;
  void remove_from(Features& features) const;

  /// Whether they are left out of images of that size.
  [[nodiscard]] bool are_known(const cv::Size& size_px) const {
    return size_px == size_px_ && num_views_ >= kFirstViews;
  }

  /// Whether they may be all that two images share, at least one of which still shows them: most
  /// inliers stay where they are, and they lie in less than half of the image. A camera that is
  /// where it was before keeps all of the image in place.
  static bool may_be_all(const Features& query, const Features& place,
                         const std::vector<Match>& inliers);

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
