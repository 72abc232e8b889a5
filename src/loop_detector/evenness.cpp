// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "evenness.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <utility>

#include "loopbit/median.hpp"

#include "image_parts.hpp"

namespace loopbit {
namespace {

constexpr int kColumns = 4;
constexpr int kRows = 3;

/// What is shared with the change of view before is known as if so many more inliers lay where the
/// features are.
constexpr double kPriorInliers = 20;

std::size_t cell_of(const Features& image, const Keypoint& keypoint) {
  return cell_of(keypoint, image.working_size_px, kColumns, kRows);
}

/// Where a place shows what is seen in the query, roughly: inliers are scaled and moved alike.
class SeenFromPlace {
 public:
  SeenFromPlace(const Features& query, const Features& place, const std::vector<Match>& inliers)
      : size_px_(place.working_size_px) {
    const auto middle = [&](auto value) {
      std::vector<double> values;
      values.reserve(inliers.size());
      for (const Match& match : inliers) {
        values.push_back(value(query.keypoint(match.query), place.keypoint(match.place)));
      }
      return median(std::move(values));
    };
    using K = Keypoint;
    scale_ = middle([](const K& from, const K& to) { return to.scale / from.scale; });
    dx_px_ = middle([&](const K& from, const K& to) { return to.x_px - scale_ * from.x_px; });
    dy_px_ = middle([&](const K& from, const K& to) { return to.y_px - scale_ * from.y_px; });
  }

  [[nodiscard]] bool contains(const Keypoint& keypoint) const {
    const double x_px = scale_ * keypoint.x_px + dx_px_;
    const double y_px = scale_ * keypoint.y_px + dy_px_;
    return x_px >= 0 && y_px >= 0 && x_px < size_px_.width && y_px < size_px_.height;
  }

 private:
  cv::Size size_px_;
  double scale_ = 1;
  double dx_px_ = 0;
  double dy_px_ = 0;
};

}  // namespace

KeypointCounts count_inliers(const Features& query, const std::vector<Match>& inliers) {
  static_assert(KeypointCounts().size() == std::size_t{kColumns} * kRows);
  KeypointCounts counts{};
  for (const Match& match : inliers) ++counts[cell_of(query, query.keypoint(match.query))];
  return counts;
}

Evenness::Evenness(const SharedView& view, const Features& query) : query_(query) {
  KeypointCounts features{};
  for (const Keypoint& keypoint : query.keypoints) ++features[cell_of(query, keypoint)];
  const double prior =
      kPriorInliers / static_cast<double>(std::max<std::size_t>(1, query.keypoints.size()));
  for (std::size_t i = 0; i < features.size(); ++i) {
    recognised_[i] = prior + static_cast<double>(view.inliers[i]) / std::max(1, features[i]);
  }
}

double Evenness::of(const std::vector<Match>& inliers, int distinct, const Features& place) const {
  if (inliers.empty()) return 1;
  const KeypointCounts found = count_inliers(query_, inliers);
  const SeenFromPlace seen_from_place(query_, place, inliers);
  KeypointCounts seen{};
  for (const Keypoint& keypoint : query_.keypoints) {
    if (seen_from_place.contains(keypoint)) ++seen[cell_of(query_, keypoint)];
  }
  std::array<double, KeypointCounts().size()> expected{};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    expected[i] = recognised_[i] * std::max(seen[i], found[i]);
  }
  const double all_expected = std::accumulate(expected.begin(), expected.end(), 0.0);
  double overlap = 0;
  double missing = 0;  // by chance, of one inlier
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double share = expected[i] / all_expected;
    overlap += std::min(share, found[i] / static_cast<double>(inliers.size()));
    // Half of the mean deviation of a share of n inliers is sqrt(p (1 - p) / (2 pi n)).
    missing += std::sqrt(share * (1 - share) / (2 * std::numbers::pi));
  }
  constexpr double kLeast = 0.1;  // of very few inliers
  return overlap / std::max(kLeast, 1 - missing / std::sqrt(std::max(1, distinct)));
}

}  // namespace loopbit
