// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "shortcuts.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>

namespace loopbit {

Shortcuts::Next Shortcuts::prepare(const Loop& loop, bool agrees) const {
  Next next{.awaiting = loop};
  if (awaiting_ && agrees) {
    next.ends = {{awaiting_->frame, awaiting_->match}, {awaiting_->match, awaiting_->frame}};
  }
  return next;
}

void Shortcuts::commit(Next next) noexcept {
  if (!next.ends.empty()) ++version_;
  ends_.merge(next.ends);
  awaiting_ = next.awaiting;
}

void Shortcuts::remove(int frame) {
  if (awaiting_ && awaiting_->frame == frame) awaiting_.reset();
  const auto end = ends_.upper_bound({frame, frame});
  for (auto at = ends_.lower_bound({frame, 0}); at != end; at = ends_.erase(at)) {
    ++version_;
    ends_.erase({at->second, frame});
  }
}

Motion across(const OdometryTrack& track, int match, int frame, const cv::Vec3d& apart_sq) {
  Motion motion = track.between(match, frame).value();
  for (int i = 0; i < 3; ++i) motion.T_from_to(i, 3) = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      if (std::min(i, j) < 3) motion.covariance(i, j) = i == j ? apart_sq[i] : 0;
    }
  }
  return motion;
}

void SurestPaths::begin() {
  version_ = shortcuts_.version();
  queue_ = {};
  surest_.clear();
  if (shortcuts_.ends().empty()) return;
  latest_ = shortcuts_.ends().rbegin()->first;
  queue_.push({0, latest_, {}});
}

std::optional<Motion> SurestPaths::from(int frame, const OdometryTrack::Frame& now,
                                        const Motion& direct) {
  if (version_ != shortcuts_.version()) begin();
  const auto onward = shortcuts_.ends().empty() ? std::nullopt : track_.to_next(latest_, now);
  if (!onward) return std::nullopt;
  double least = doubt(direct);
  search(least);
  std::optional<Motion> surest;
  const auto try_from = [&](const std::pair<const int, Motion>& end) {
    const auto step = track_.between(frame, end.first);
    if (!step) return;
    const Motion motion = chained(chained(*step, end.second), *onward);
    if (doubt(motion) >= least) return;
    least = doubt(motion);
    surest = motion;
  };
  const auto after = surest_.lower_bound(frame);
  if (after != surest_.end()) try_from(*after);
  if (after != surest_.begin()) try_from(*std::prev(after));
  return surest;
}

/// How little the position is known, in units of how far apart two views may be: on the axis where
/// it is known least.
double SurestPaths::doubt(const Motion& motion) const {
  const cv::Matx66d& c = motion.covariance;
  return std::max({c(0, 0) / apart_sq_[0], c(1, 1) / apart_sq_[1], c(2, 2) / apart_sq_[2]});
}

/// Finds the paths with less doubt.
void SurestPaths::search(double most_doubt) {
  constexpr std::size_t kMostEnds = 300;  // so that a frame takes some milliseconds at most
  const auto& ends = shortcuts_.ends();
  while (!queue_.empty() && queue_.top().doubt < most_doubt && surest_.size() < kMostEnds) {
    const Reached next = queue_.top();
    queue_.pop();
    const bool is_new = surest_.emplace(next.frame, next.motion).second;
    if (!is_new) continue;
    const auto first = ends.lower_bound({next.frame, 0});
    auto at = first;
    for (; at != ends.end() && at->first == next.frame; ++at) {
      reach(at->second, across(track_, at->second, next.frame, apart_sq_), next.motion);
    }
    if (at != ends.end()) reach(at->first, track_.between(at->first, next.frame), next.motion);
    if (first != ends.begin()) {
      const int earlier = std::prev(first)->first;
      reach(earlier, track_.between(earlier, next.frame), next.motion);
    }
  }
}

void SurestPaths::reach(int frame, const std::optional<Motion>& step, const Motion& onward) {
  if (!step || surest_.contains(frame)) return;
  const Motion motion = chained(*step, onward);
  queue_.push({doubt(motion), frame, motion});
}

}  // namespace loopbit
