// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "exclusion_window.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "loopbit/error.hpp"

#include "attached_parts.hpp"
#include "companion.hpp"
#include "image_parts.hpp"

namespace loopbit {

class ExclusionWindow::Comparison {
 public:
  Comparison(Image image, const Places& places, const CameraModel* camera, Workspace& work)
      : image_(image), places_(places), camera_(camera), work_(work) {}

  [[nodiscard]] const Image& image() const { return image_; }

  const Verification& with(PlaceId place) {
    if (place == latest_) return work_.verification;
    const Features& recent = places_.features(place, work_.held);
    work_.verifier.match(image_.features, recent, work_.verification);
    work_.verifier.find_geometry(image_.features, recent, work_.verification, camera_);
    latest_ = place;
    return work_.verification;
  }

  /// The frame's keypoints that a recent place shows, too, elsewhere in the image. Those that did
  /// not move may be the robot itself, which is in view for ever.
  std::vector<Keypoint> moved_from(PlaceId place) {
    const Verification& shared = with(place);
    const Features& recent = places_.features(place, work_.held);
    std::vector<Keypoint> moved;
    for (const Match& match : shared.inliers) {
      const Keypoint& keypoint = image_.features.keypoint(match.query);
      if (!is_unmoved(keypoint, recent.keypoint(match.place))) moved.push_back(keypoint);
    }
    return moved;
  }

  void leave_out(const BinaryContent& pixels) {
    clear(image_.content, pixels);
    remove_features(image_.features, [&](const Keypoint& keypoint) {
      return is_set(pixels, content_pixel(keypoint, image_.features.working_size_px));
    });
    latest_ = kNone;
  }

 private:
  static constexpr PlaceId kNone = -1;  // places of this session are not negative

  Image image_;
  const Places& places_;
  const CameraModel* camera_;
  Workspace& work_;
  PlaceId latest_ = kNone;
};

void ExclusionWindow::check_time(std::optional<double> timestamp_s) const {
  if (options_.exclusion.seconds <= 0) return;
  const PlaceId frame = places_.size() - places_.session_begin();
  if (!timestamp_s || !std::isfinite(*timestamp_s)) {
    throw Error(ErrorKind::input,
                fmt::format("Frame {} has no usable timestamp, but exclusion.seconds is {}; give "
                            "times, or set exclusion.frames in its place.",
                            frame, options_.exclusion.seconds));
  }
  if (!times_s_.empty() && *timestamp_s < times_s_.back()) {
    throw Error(ErrorKind::input,
                fmt::format("Frame {} has timestamp {} s, before the last one of {} s; give the "
                            "frames in order of time.",
                            frame, *timestamp_s, times_s_.back()));
  }
}

ExclusionWindow::View ExclusionWindow::view(Image image, std::optional<double> timestamp_s,
                                            const CameraModel* camera, Workspace& work) const {
  Comparison comparison(image, places_, camera, work);
  const RecentView::Look found = look(comparison);
  return {found, begin(found, timestamp_s), shared_view(comparison, found.is_step)};
}

bool ExclusionWindow::is_in_view(const std::vector<Keypoint>& shared) const {
  return std::ssize(shared) >= options_.exclusion.in_view_inliers;
}

/// How far back the view of the frame reaches.
RecentView::Look ExclusionWindow::look(Comparison& comparison) const {
  const RecentView& view = places_.recent_view();
  const auto oldest = view.long_in_view();
  const bool is_companion_left_out = oldest && leave_out_companion(comparison, *oldest);
  const bool is_step = places_.changes_view(comparison.image().content);
  return view.look(
      places_.size(), is_step,
      [&](PlaceId place) {
        // A fixed window does not depend on the view, of which only the latest step is needed.
        return !is_fixed() && is_in_view(comparison.moved_from(place));
      },
      is_companion_left_out);
}

/// Leaves out what the frame shares with a place that was in view long ago, unless that is most of
/// the image. Returns whether there is such a thing.
bool ExclusionWindow::leave_out_companion(Comparison& comparison, PlaceId place) const {
  if (is_fixed() || options_.decision.count_matches) return false;
  const std::vector<Keypoint> shared = comparison.moved_from(place);
  if (!is_in_view(shared)) return false;
  const BinaryContent pixels = companion_pixels(comparison.image().features, shared);
  if (count(pixels) == 0) return false;
  comparison.leave_out(pixels);
  return true;
}

PlaceId ExclusionWindow::begin(const RecentView::Look& look,
                               std::optional<double> timestamp_s) const {
  const ExclusionOptions& exclusion = options_.exclusion;
  PlaceId first = look.begin;
  if (exclusion.frames > 0) first = places_.size() - exclusion.frames;
  if (exclusion.seconds > 0) {
    const auto recent =
        std::upper_bound(times_s_.begin(), times_s_.end(), *timestamp_s - exclusion.seconds);
    first = places_.session_begin() + static_cast<PlaceId>(recent - times_s_.begin());
  }
  return std::max(places_.session_begin(), std::min(first, places_.size() - exclusion.min_frames));
}

/// A frame that shows the same as the last step can recognise as much.
SharedView ExclusionWindow::shared_view(Comparison& comparison, bool is_step) const {
  if (options_.decision.count_matches || places_.recent_view().empty()) return {};
  if (!is_step) return latest_shared_;
  const Verification& shared = comparison.with(places_.recent_view().latest_step());
  return {shared.distinct_inliers, count_inliers(comparison.image().features, shared.inliers)};
}

void ExclusionWindow::reserve_next() {
  if (times_s_.size() == times_s_.capacity()) times_s_.reserve(2 * times_s_.size() + 1);
}

void ExclusionWindow::add(const Detection& frame, const std::optional<View>& view) noexcept {
  // The time of a frame that nothing matches may be wrong, and would shut out those after it.
  const double last_s =
      times_s_.empty() ? -std::numeric_limits<double>::infinity() : times_s_.back();
  times_s_.push_back(frame.status == Status::unreadable ? last_s : frame.timestamp_s.value_or(0.0));
  if (view) latest_shared_ = view->shared;
}

}  // namespace loopbit
