// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <queue>
#include <set>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/odometry.hpp"

namespace loopbit {

/// Loops of a session as shortcuts of odometry: a robot that is back at a place is where it was
/// then, however far odometry has drifted since.
class Shortcuts {
 public:
  struct Loop {
    int frame = 0;
    int match = 0;
  };

  /// What commit() changes.
  struct Next {
    std::set<std::pair<int, int>> ends = {};
    std::optional<Loop> awaiting = std::nullopt;
  };

  /// Takes the memory for a loop that awaits one that agrees with it. `agrees`: the loop that
  /// awaited one becomes a shortcut.
  [[nodiscard]] Next prepare(const Loop& loop, bool agrees) const;

  /// Adds what prepare() gave.
  void commit(Next next) noexcept;

  /// The latest loop that commit() was given. It is no shortcut yet.
  [[nodiscard]] const std::optional<Loop>& awaiting() const { return awaiting_; }

  /// Forgets the loop of `frame`, if there is one.
  void remove(int frame);

  /// Each shortcut twice: from and to its match.
  [[nodiscard]] const std::set<std::pair<int, int>>& ends() const { return ends_; }

  /// Another number after each change of ends().
  [[nodiscard]] int version() const { return version_; }

 private:
  std::set<std::pair<int, int>> ends_;
  std::optional<Loop> awaiting_;
  int version_ = 0;
};

/// The motion between the frames of a loop, which is that both show one place: apart by a distance
/// with the variances `apart_sq` along the axes of the camera. How the camera turned in between,
/// odometry tells, which has to be known at both.
Motion across(const OdometryTrack& track, int match, int frame, const cv::Vec3d& apart_sq);

/// The motions from earlier frames to the present one along the surest paths of odometry and
/// shortcuts (Dijkstra's algorithm). They are found as far as they are asked for, and remembered
/// until shortcuts change: 10 us for each end of a shortcut, of which it takes 300 at most. Not
/// thread-safe.
class SurestPaths {
 public:
  /// `track` and `shortcuts` must outlive this. `apart_sq`: see across().
  SurestPaths(const OdometryTrack& track, const Shortcuts& shortcuts, const cv::Vec3d& apart_sq)
      : track_(track), shortcuts_(shortcuts), apart_sq_(apart_sq) {}

  /// The motion from `frame` to `now`, the frame to come, if a path with a shortcut is surer than
  /// `direct`, that of odometry.
  [[nodiscard]] std::optional<Motion> from(int frame, const OdometryTrack::Frame& now,
                                           const Motion& direct);

 private:
  struct Reached {
    double doubt;
    int frame;
    Motion motion;  ///< from `frame` to latest_
    bool operator>(const Reached& other) const {
      return std::pair(doubt, frame) > std::pair(other.doubt, other.frame);
    }
  };

  [[nodiscard]] double doubt(const Motion& motion) const;
  void begin();
  void search(double most_doubt);
  void reach(int frame, const std::optional<Motion>& step, const Motion& onward);

  const OdometryTrack& track_;
  const Shortcuts& shortcuts_;
  cv::Vec3d apart_sq_;
  int version_ = 0;  ///< of shortcuts_
  int latest_ = 0;   ///< end of a shortcut, where all paths pass
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> queue_;
  std::map<int, Motion> surest_;  ///< by frame, of those whose path is found
};

}  // namespace loopbit
