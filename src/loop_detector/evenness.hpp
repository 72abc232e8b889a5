// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

namespace loopbit {

/// Keypoints of an image in 4 x 3 cells of it.
using KeypointCounts = std::array<int, 12>;

/// What a frame shares with the change of view before: what can be recognised of it.
struct SharedView {
  int distinct_inliers = 0;
  KeypointCounts inliers{};
};

/// Of the query's keypoints.
KeypointCounts count_inliers(const Features& query, const std::vector<Match>& inliers);

/// How evenly inliers lie over what can be recognised of a frame. At the place that it shows they
/// are everywhere; at another place, they are where the two look alike, such as one side of a
/// street.
class Evenness {
 public:
  /// `query` must outlive this.
  Evenness(const SharedView& view, const Features& query);

  /// The overlap of the cells where `inliers` lie and of those where they are expected, as a share
  /// of the one that as many `distinct` inliers would have by chance. They are expected where the
  /// frame can be recognised and `place` shows it, too. About 1 if they lie evenly; 1 without
  /// inliers.
  [[nodiscard]] double of(const std::vector<Match>& inliers, int distinct,
                          const Features& place) const;

 private:
  const Features& query_;
  std::array<double, KeypointCounts().size()> recognised_{};  ///< of each keypoint, by cell
};

}  // namespace loopbit
