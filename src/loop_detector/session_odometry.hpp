// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <utility>

#include "loopbit/detection.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/odometry.hpp"

#include "path_motion.hpp"
#include "places.hpp"
#include "reach.hpp"
#include "shortcuts.hpp"

namespace loopbit {

/// What odometry tells of the places of a session: how far away they are, and how the robot moves
/// from one to the next. Earlier sessions are not known to it.
class SessionOdometry {
 public:
  /// `options` and `places` must outlive this.
  SessionOdometry(const LoopDetectorOptions& options, const Places& places);

  /// From the frame to come. It must not outlive this. Not thread-safe.
  [[nodiscard]] Reach reach(const OdometryPose& now) {
    return {track_, paths_, now, options_.decision};
  }

  /// How far `place` is, see Reach::chi2(): the most of all visits before `end`, since what drifted
  /// least since one of them tells most.
  [[nodiscard]] double chi2(const Reach& reach, PlaceId place, PlaceId end) const;

  /// How well moves along a path agree with the motion since the latest step. Null if that is not
  /// known. `now`: at the frame to come. The answer must not outlive this.
  [[nodiscard]] AgreementOfMoves agreement_of_moves(const std::optional<OdometryPose>& now) const;

  /// What commit() needs if `loop` tells anything. A loop that odometry does not doubt is a
  /// shortcut as soon as another one agrees with it, far enough away to be more than the same
  /// coincidence.
  [[nodiscard]] std::optional<Shortcuts::Next> shortcuts_with(const Detection& loop,
                                                              const Reach& reach) const;
  void commit(Shortcuts::Next next) noexcept { shortcuts_.commit(std::move(next)); }

  /// The loop of `frame` is wrong.
  void remove_shortcut(int frame) { shortcuts_.remove(frame); }

  /// See OdometryTrack.
  void reserve_next(bool is_known) { track_.reserve_next(is_known); }
  void add(const std::optional<OdometryPose>& pose) { track_.add(pose); }

 private:
  /// The frame that shows a step first, if it is one of this session.
  [[nodiscard]] std::optional<int> frame_of(std::ptrdiff_t step) const;

  const LoopDetectorOptions& options_;
  const Places& places_;
  OdometryTrack track_;
  Shortcuts shortcuts_;
  SurestPaths paths_;
};

}  // namespace loopbit
