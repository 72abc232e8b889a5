// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "still_features.hpp"

#include <cmath>
#include <cstddef>

namespace loopbit {
namespace {

constexpr float kMaxMotion_px = 2.0F;
constexpr int kMinSteps = 3;

}  // namespace

StillFeatures::StillFeatures(const Features& features, const StillFeatures& latest,
                             std::span<const Match> matches, bool is_step) {
  tracks_.reserve(features.keypoints.size());
  for (const Keypoint& keypoint : features.keypoints) {
    tracks_.push_back({keypoint.x_px, keypoint.y_px, 0});
  }
  for (const Match& match : matches) {
    if (static_cast<std::size_t>(match.place) >= latest.tracks_.size()) continue;
    Track& track = tracks_[static_cast<std::size_t>(match.query)];
    const Track& before = latest.tracks_[static_cast<std::size_t>(match.place)];
    if (std::hypot(track.x_px - before.x_px, track.y_px - before.y_px) > kMaxMotion_px) continue;
    track = {before.x_px, before.y_px, before.steps + static_cast<int>(is_step)};
  }
}

bool StillFeatures::is_still(int feature) const {
  return tracks_[static_cast<std::size_t>(feature)].steps >= kMinSteps;
}

}  // namespace loopbit
