// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "loopbit/place_index.hpp"

namespace loopbit {

/// How far back the camera's present view reaches without a break, which is where "recent" ends and
/// "earlier" begins.
///
/// Driving forward, the scene ahead is seen again and again; standing still, all of it is. Neither
/// is a revisit. So the view is followed along the frames that changed it (steps: a camera at rest
/// makes none): its far end stays at a step for as long as that step shares geometry with the
/// newest one, and moves on by at most two steps a step, so that one blurred frame does not cut the
/// view off.
///
/// What travels with the robot and moves in the image, such as a car ahead of it or its own arm, is
/// in view for ever: a companion. Where it can be left out of a frame, the view is what else is
/// seen.
class RecentView {
 public:
  /// Where the far end of the view would be if the camera were now at a new frame.
  struct Look {
    bool is_step = false;      ///< the new frame changes the view
    std::size_t far_step = 0;  ///< the oldest step still in view, an index
    /// The same with a companion, at most far_step.
    std::size_t companion_step = 0;
    PlaceId begin = 0;  ///< the first place that is recent; those before are candidates
  };

  /// A place that has been in view for so long that what it shares with a new frame may be a
  /// companion.
  [[nodiscard]] std::optional<PlaceId> long_in_view() const;

  /// `newest`: the number of the new frame. `is_step`: it differs from latest_step() in looks.
  /// `in_view(place)`: it shares geometry with that place; asked at most twice.
  /// `is_companion_left_out`: what it shares with long_in_view() was left out of it before.
  [[nodiscard]] Look look(PlaceId newest, bool is_step, const std::function<bool(PlaceId)>& in_view,
                          bool is_companion_left_out = false) const;

  /// Takes the memory that the next remember() needs, so that it does not throw.
  void reserve_next();

  /// Makes `look` the present state. `newest` as in look().
  void remember(PlaceId newest, const Look& look);

  [[nodiscard]] bool empty() const { return steps_.empty(); }
  [[nodiscard]] PlaceId latest_step() const { return steps_.back(); }

  /// Whether look() may ask for `place`.
  [[nodiscard]] bool is_in_view(PlaceId place) const {
    return companion_step_ < steps_.size() && place >= steps_[companion_step_];
  }

  /// Where along the path `place` lies, counted in steps.
  [[nodiscard]] std::ptrdiff_t step_of(PlaceId place) const;

  /// The first place of a step, if there is such a step.
  [[nodiscard]] std::optional<PlaceId> place_of(std::ptrdiff_t step) const;

 private:
  /// A far end, once it has moved on to what is in view.
  [[nodiscard]] std::size_t moved_on(std::size_t far_step,
                                     const std::function<bool(PlaceId)>& in_view) const;

  std::vector<PlaceId> steps_;
  std::size_t far_step_ = 0;
  std::size_t companion_step_ = 0;
};

}  // namespace loopbit
