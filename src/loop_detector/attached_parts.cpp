// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "attached_parts.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>

#include "image_parts.hpp"

namespace loopbit {
namespace {

constexpr int kReach_px = 2;

/// A spot is attached if so many of the latest views, at most 16, have a feature there: all of the
/// first 4, 6 of 8, 8 of 16. By chance one of 600 features lies within 2 px of a spot in a view of
/// 640 x 480 with a probability of 0.03, and in a crowded part of 0.15: in so many views then with
/// at most 0.0014, however many views there are.
constexpr int least_seen(int num_views) { return (num_views + 10) / 3; }
static_assert(least_seen(AttachedParts::kFirstViews) == AttachedParts::kFirstViews);

/// Beside a part, half of the latest 6 views are enough: when the light changes, other features of
/// it come up.
constexpr int kViewsBeside = 6;
/// Fewer spots are distant things that a straight path keeps in place.
constexpr int kMinSpots = 16;
constexpr int kBeside_px = 6;

/// As std::lround(), which is a call, for x >= 0: a double has bits enough for the sum.
int rounded(float x) {
  return static_cast<int>(static_cast<double>(x) + 0.5);  // NOLINT(bugprone-incorrect-roundings)
}

}  // namespace

bool is_unmoved(const Keypoint& a, const Keypoint& b) {
  return std::hypot(b.x_px - a.x_px, b.y_px - a.y_px) <= static_cast<float>(kReach_px);
}

void AttachedParts::remove_from(BinaryContent& content) const { clear(content, parts_); }

void AttachedParts::remove_from(Features& features) const {
  if (features.working_size_px != size_px_) return;
  remove_features(features, [this](const Keypoint& keypoint) { return is_attached(keypoint); });
}

bool AttachedParts::may_be_all(const Features& query, const Features& place,
                               const std::vector<Match>& inliers) {
  if (place.working_size_px != query.working_size_px) return false;
  std::vector<Keypoint> unmoved;
  for (const Match& match : inliers) {
    const Keypoint& keypoint = query.keypoint(match.query);
    if (is_unmoved(keypoint, place.keypoint(match.place))) unmoved.push_back(keypoint);
  }
  return 2 * unmoved.size() > inliers.size() && is_lesser_part(unmoved, query);
}

void AttachedParts::reserve_next(const cv::Size& working_size_px) {
  next_.clear();
  if (working_size_px == size_px_) return;
  next_.resize(static_cast<std::size_t>(working_size_px.area()));
}

void AttachedParts::remember(const cv::Size& working_size_px,
                             const std::vector<Keypoint>& keypoints) {
  if (working_size_px != size_px_) {
    size_px_ = working_size_px;
    views_.swap(next_);
    num_views_ = 0;
    parts_ = {};
    beside_ = {};
  }
  if (shows_last_view(keypoints)) return;
  note(keypoints);
  find_parts(keypoints);
}

std::size_t AttachedParts::index_of(int x_px, int y_px) const {
  const int x = std::clamp(x_px, 0, size_px_.width - 1);
  const int y = std::clamp(y_px, 0, size_px_.height - 1);
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(size_px_.width) +
         static_cast<std::size_t>(x);
}

AttachedParts::Views AttachedParts::views_at(const Keypoint& keypoint) const {
  return views_[index_of(rounded(keypoint.x_px), rounded(keypoint.y_px))];
}

bool AttachedParts::is_attached(const Keypoint& keypoint) const {
  const cv::Point pixel = content_pixel(keypoint, size_px_);
  if (is_set(parts_, pixel)) return true;
  if (!is_set(beside_, pixel)) return false;
  constexpr Views kLatest = (1U << static_cast<unsigned>(kViewsBeside)) - 1U;
  const Views latest = std::rotr(views_at(keypoint), num_views_ - kViewsBeside) & kLatest;
  return 2 * std::popcount(latest) >= kViewsBeside;
}

bool AttachedParts::shows_last_view(const std::vector<Keypoint>& keypoints) const {
  struct Cell {
    int features = 0;
    int unmoved = 0;
  };
  PerCell<Cell> cells;
  for (const Keypoint& keypoint : keypoints) {
    Cell& cell = cells.at(cell_of(keypoint, size_px_));
    ++cell.features;
    if ((std::rotr(views_at(keypoint), num_views_ - 1) & 1U) != 0) ++cell.unmoved;
  }
  // A camera that stands still repeats a third of the features of most cells or more, even in
  // noise; one that moves repeats less than a fifth by chance, but for what is attached.
  const auto seen =
      std::count_if(cells.begin(), cells.end(), [](const Cell& cell) { return cell.features > 0; });
  const auto unmoved = std::count_if(cells.begin(), cells.end(), [](const Cell& cell) {
    return cell.features > 0 && 3 * cell.unmoved >= cell.features;
  });
  return 2 * unmoved >= seen;
}

void AttachedParts::note(const std::vector<Keypoint>& keypoints) {
  const Views bit = std::rotl(Views{1}, num_views_);
  ++num_views_;
  for (Views& views : views_) views &= static_cast<Views>(~bit);
  for (const Keypoint& keypoint : keypoints) {
    const cv::Point middle(rounded(keypoint.x_px), rounded(keypoint.y_px));
    for (int y = middle.y - kReach_px; y <= middle.y + kReach_px; ++y) {
      const std::size_t last = index_of(middle.x + kReach_px, y);
      for (std::size_t i = index_of(middle.x - kReach_px, y); i <= last; ++i) views_[i] |= bit;
    }
  }
}

void AttachedParts::find_parts(const std::vector<Keypoint>& keypoints) {
  const int views = std::min(num_views_, std::numeric_limits<Views>::digits);
  BinaryContent spots;
  for (const Keypoint& keypoint : keypoints) {
    if (std::popcount(views_at(keypoint)) < least_seen(views)) continue;
    set(spots, content_pixel(keypoint, size_px_));
  }
  if (count(spots) < kMinSpots) spots = {};
  parts_ = closed(spots);
  beside_ = dilated(spots, kBeside_px);
}

}  // namespace loopbit
