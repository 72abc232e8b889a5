// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "places.hpp"

#include <algorithm>
#include <utility>

namespace loopbit {
namespace {

/// Two frames this alike show the same view: the camera has hardly moved in between.
constexpr double kUnmovedSimilarity = 0.8;

}  // namespace

Places::Places(const LoopDetectorOptions& options, std::shared_ptr<MapStorage> map)
    : memory_(std::move(map)), contents_(memory_) {
  memory_.check_options(options);
  restore_places();
  restore_loops();
}

void Places::restore_places() {
  if (memory_.is_searched()) return memory_.restore_searched(kUnmovedSimilarity);
  std::optional<PlaceId> latest_step;
  memory_.restore([&](const BinaryContent& content) {
    const bool is_step = changes_view(content, latest_step);
    const PlaceId place = contents_.add(content);
    if (is_step) latest_step = place;
    return is_step;
  });
}

void Places::restore_loops() {
  memory_.restore_loops([this](std::ptrdiff_t step, std::ptrdiff_t earlier_step) {
    known_loops_.add(step, earlier_step);
  });
  epoch_ = memory_.epoch();
}

void Places::learn() {
  const MapNews news = memory_.news();
  for (const auto& [at, content] : news.places) {
    const bool is_step = changes_view(content, memory_.latest_step(at.session));
    contents_.add_new(content);
    memory_.add_new(at, is_step);
  }
  const auto with_steps = [this](const MapNews::Loop& loop, const auto& use) {
    const auto place = find(loop.query);
    const auto match = find(loop.match);
    if (place && match) use(step_of(*place), step_of(*match));
  };
  for (const MapNews::Loop& loop : news.loops) {
    with_steps(loop, [this](auto step, auto match) { known_loops_.add(step, match); });
  }
  for (const MapNews::Loop& loop : news.rejected) {
    with_steps(loop, [this](auto step, auto match) { known_loops_.remove(step, match); });
  }
  epoch_ = std::max(epoch_, news.epoch);
}

SessionFrame Places::origin(PlaceId place) const {
  const PlaceId begin = session_begin();
  return place < begin ? memory_.origin(place) : SessionFrame{0, place - begin};
}

std::optional<PlaceId> Places::find(const SessionFrame& at) const {
  if (at.session != 0) return memory_.find(at);
  if (at.frame < 0 || at.frame >= size() - session_begin()) return std::nullopt;
  return session_begin() + at.frame;
}

std::ptrdiff_t Places::step_of(PlaceId place) const {
  return place < session_begin() ? memory_.step_of(place) : recent_view_.step_of(place);
}

std::ptrdiff_t Places::steps_into_session(PlaceId place) const {
  return place < session_begin() ? memory_.steps_into_session(place) : recent_view_.step_of(place);
}

std::optional<PlaceId> Places::place_of(std::ptrdiff_t step) const {
  return step < 0 ? memory_.place_of(step) : recent_view_.place_of(step);
}

Spot Places::spot_of(PlaceId place) const { return loopbit::spot_of(step_of(place), known_loops_); }

std::ptrdiff_t Places::steps_before(PlaceId end) const {
  return memory_.earlier_steps() + (end == 0 ? 0 : recent_view_.step_of(end - 1) + 1);
}

bool Places::changes_view(const BinaryContent& content) const {
  return changes_view(
      content, recent_view_.empty() ? std::nullopt : std::optional(recent_view_.latest_step()));
}

/// A content without pixels, of a dark or covered camera, says nothing of the view.
bool Places::changes_view(const BinaryContent& content, std::optional<PlaceId> latest_step) const {
  if (!latest_step) return true;
  return similarity(content, contents_.content(*latest_step)) < kUnmovedSimilarity &&
         count(content) > 0;
}

void Places::add(const BinaryContent& content, Features features,
                 const std::optional<RecentView::Look>& look, const Detection& detection,
                 const cv::Mat& image) {
  contents_.reserve_next();
  recent_view_.reserve_next();
  memory_.add(detection, content, std::move(features), image);
  const PlaceId place = contents_.add(content);
  if (!look) return;
  recent_view_.remember(place, *look);
  memory_.leave_behind([this](PlaceId removed) { return recent_view_.is_in_view(removed); });
}

}  // namespace loopbit
