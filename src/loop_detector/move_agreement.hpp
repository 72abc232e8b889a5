// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "loopbit/odometry.hpp"

namespace loopbit {

/// How well odometry agrees that the robot follows an earlier path from a step of it. A camera that
/// sees again what it saw there moves as it moved there: as far ahead, to the side and up, and with
/// the same turns. Only motions between near frames count, so it does not matter how far odometry
/// has drifted.
class MoveAgreement {
 public:
  /// Frames of the path: the step where moves begin, and one step before and after that.
  struct Around {
    std::optional<int> before;
    int at = 0;
    std::optional<int> after;
  };

  /// `track` (of the path) and `latest` (the motion of the last step) must outlive this.
  MoveAgreement(const OdometryTrack& track, const Motion& latest, const Around& begin);

  /// The likelihood of the move to the frame `end`, as a share of that of the same motion: 0 to 1.
  /// Both motions are known to a step: by as much as the camera moves or turns from one step to the
  /// next, either way (a uniform distribution), and by the drift of odometry. None if odometry is
  /// not known.
  [[nodiscard]] std::optional<double> likelihood(int end) const;

 private:
  /// Variances of an axis, without the drift of the path.
  struct Variances {
    double move = 0;
    double turn = 0;
  };

  const OdometryTrack& track_;
  const Motion& latest_;
  int begin_;
  Variances known_;
};

}  // namespace loopbit
