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

}  // namespace

RecentView::Look RecentView::look(PlaceId newest, bool is_step,
                                  const std::function<bool(PlaceId)>& in_view) const {
  Look look{is_step, far_step_, 0};
  if (is_step) {
    const std::size_t furthest = std::min(far_step_ + kMaxStepsForward, steps_.size());
    while (look.far_step < furthest && !in_view(steps_[look.far_step])) ++look.far_step;
  }
  const std::size_t reach = steps_.size() - look.far_step;
  const std::size_t begin = look.far_step - std::min({reach, kMaxMarginSteps, look.far_step});
  look.begin = begin < steps_.size() ? steps_[begin] : newest;
  return look;
}

void RecentView::reserve_next() {
  if (steps_.size() == steps_.capacity()) steps_.reserve(2 * steps_.size() + 1);
}

void RecentView::remember(PlaceId newest, const Look& look) {
  if (look.is_step) steps_.push_back(newest);
  far_step_ = look.far_step;
}

std::ptrdiff_t RecentView::step_of(PlaceId place) const {
  return std::upper_bound(steps_.begin(), steps_.end(), place) - steps_.begin() - 1;
}

std::optional<PlaceId> RecentView::place_of(std::ptrdiff_t step) const {
  if (step < 0 || step >= std::ssize(steps_)) return std::nullopt;
  return steps_[static_cast<std::size_t>(step)];
}

}  // namespace loopbit
