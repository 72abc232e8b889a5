// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "recent_view.hpp"

#include <algorithm>

namespace loopbit {
namespace {

constexpr std::size_t kMaxStepsForward = 2;
/// The view's reach is measured with single frames, some of them blurred or empty, so as much again
/// is kept clear of candidates, but no more than this: a robot that worked an hour in one room must
/// recognise what it saw before.
constexpr std::size_t kMaxMarginSteps = 30;
/// A scene stays in view for some 5 to 30 steps, and for up to 62 where a robot takes an image
/// every 0.2 m. What stays for longer may travel with it.
constexpr std::size_t kLongestViewSteps = 64;

}  // namespace

std::optional<PlaceId> RecentView::long_in_view() const {
  if (steps_.size() - companion_step_ <= kLongestViewSteps) return std::nullopt;
  return steps_[companion_step_];
}

std::size_t RecentView::moved_on(std::size_t far_step,
                                 const std::function<bool(PlaceId)>& in_view) const {
  const std::size_t furthest = std::min(far_step + kMaxStepsForward, steps_.size());
  while (far_step < furthest && !in_view(steps_[far_step])) ++far_step;
  return far_step;
}

RecentView::Look RecentView::look(PlaceId newest, bool is_step,
                                  const std::function<bool(PlaceId)>& in_view,
                                  bool is_companion_left_out) const {
  Look look{is_step, far_step_, companion_step_, 0};
  if (is_step && is_companion_left_out) look.far_step = moved_on(far_step_, in_view);
  if (is_step && !is_companion_left_out) {
    look.companion_step = moved_on(companion_step_, in_view);
    look.far_step = std::max(far_step_, look.companion_step);
  }
  const std::size_t end = is_companion_left_out ? look.far_step : look.companion_step;
  // Without the features of a companion, the reach is less certain.
  const std::size_t margin =
      is_companion_left_out ? kMaxMarginSteps : std::min(steps_.size() - end, kMaxMarginSteps);
  const std::size_t begin = end - std::min(margin, end);
  look.begin = begin < steps_.size() ? steps_[begin] : newest;
  return look;
}

void RecentView::reserve_next() {
  if (steps_.size() == steps_.capacity()) steps_.reserve(2 * steps_.size() + 1);
}

void RecentView::remember(PlaceId newest, const Look& look) {
  if (look.is_step) steps_.push_back(newest);
  far_step_ = look.far_step;
  companion_step_ = look.companion_step;
}

std::ptrdiff_t RecentView::step_of(PlaceId place) const {
  return std::upper_bound(steps_.begin(), steps_.end(), place) - steps_.begin() - 1;
}

std::optional<PlaceId> RecentView::place_of(std::ptrdiff_t step) const {
  if (step < 0 || step >= std::ssize(steps_)) return std::nullopt;
  return steps_[static_cast<std::size_t>(step)];
}

}  // namespace loopbit
