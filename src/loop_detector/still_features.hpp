// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include "loopbit/verification.hpp"

namespace loopbit {

/// What moves with the camera: a bonnet, the robot's own arm, dirt on the lens. It is in view
/// everywhere, so it tells no place. Features that stayed where they were in the image while the
/// view changed three times are taken for such.
class StillFeatures {
 public:
  StillFeatures() = default;
  /// Of an image with `features`, from its matches with the latest change of view, whose
  /// features are `latest`. `is_step`: the image changes the view itself.
  StillFeatures(const Features& features, const StillFeatures& latest,
                std::span<const Match> matches, bool is_step);

  [[nodiscard]] bool is_still(int feature) const;

  /// Takes out the matches of those of the query.
  void remove_from(std::vector<Match>& matches) const {
    std::erase_if(matches, [&](const Match& match) { return is_still(match.query); });
  }

 private:
  struct Track {
    float x_px = 0;  ///< where it was first seen
    float y_px = 0;
    int steps = 0;  ///< changes of view that left it there
  };

  std::vector<Track> tracks_;  ///< one a feature
};

}  // namespace loopbit
