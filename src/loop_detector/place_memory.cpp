// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "place_memory.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace loopbit {
namespace {

/// Sessions are so many steps apart: no neighbours, whatever a match may move from one step to the
/// next.
constexpr int kStepsBetweenSessions = 1000;

/// Sessions that grow have steps below those of earlier ones, with room for 2^32 steps each.
constexpr std::ptrdiff_t kStepsOfSession = std::ptrdiff_t{1} << 32;

}  // namespace

void PlaceMemory::add_earlier(const SessionFrame& origin, bool is_step) {
  earlier_steps_ += is_step ? 1 : 0;
  int step = 0;
  if (!earlier_.empty()) {
    const EarlierPlace& last = earlier_.back();
    const bool same_session = last.origin.session == origin.session;
    step = last.step + (same_session ? static_cast<int>(is_step) : kStepsBetweenSessions);
  }
  earlier_.push_back({origin, step});
}

std::optional<PlaceId> PlaceMemory::find(const SessionFrame& origin) const {
  if (const auto found = find_new(origin)) return found;
  const auto key = [](const SessionFrame& at) { return std::pair(at.session, at.frame); };
  const auto found = std::lower_bound(
      earlier_.begin(), earlier_.end(), key(origin),
      [&](const EarlierPlace& place, const auto& wanted) { return key(place.origin) < wanted; });
  if (found == earlier_.end() || !(found->origin == origin)) return std::nullopt;
  return static_cast<PlaceId>(found - earlier_.begin());
}

std::optional<PlaceId> PlaceMemory::find_new(const SessionFrame& origin) const {
  const auto session = new_sessions_.find(origin.session);
  if (session == new_sessions_.end()) return std::nullopt;
  const std::vector<PlaceId>& places = session->second.places;
  const auto frame = [this](PlaceId place) { return new_place(place).origin.frame; };
  const auto found = std::ranges::lower_bound(places, origin.frame, {}, frame);
  if (found == places.end() || frame(*found) != origin.frame) return std::nullopt;
  return *found;
}

std::optional<PlaceId> PlaceMemory::latest_step(int session) const {
  const auto found = new_sessions_.find(session);
  if (found == new_sessions_.end()) return std::nullopt;
  return found->second.steps.back();
}

void PlaceMemory::add_new(const SessionFrame& origin, bool is_step) {
  const auto place = static_cast<PlaceId>(-1 - static_cast<std::ptrdiff_t>(new_.size()));
  const auto [found, is_first] = new_sessions_.try_emplace(origin.session);
  NewSession& session = found->second;
  if (is_first) {
    session.first_step = -kStepsOfSession * (1 + static_cast<std::ptrdiff_t>(new_sessions_.size()));
    by_first_step_[session.first_step] = &session;
  }
  session.places.push_back(place);
  if (is_step) session.steps.push_back(place);
  earlier_steps_ += is_step ? 1 : 0;
  const auto steps = static_cast<std::ptrdiff_t>(session.steps.size());
  new_.push_back({origin, session.first_step + steps - 1});
}

std::ptrdiff_t PlaceMemory::step_of(PlaceId place) const {
  if (place < 0) return new_place(place).step;
  const std::ptrdiff_t step = earlier_[static_cast<std::size_t>(place)].step;
  return step - earlier_.back().step - kStepsBetweenSessions;
}

std::ptrdiff_t PlaceMemory::steps_into_session(PlaceId place) const {
  const int session = origin(place).session;
  if (place < 0) return new_place(place).step - new_sessions_.at(session).first_step;
  const auto first = std::ranges::lower_bound(
      earlier_, session, {}, [](const EarlierPlace& earlier) { return earlier.origin.session; });
  return earlier_[static_cast<std::size_t>(place)].step - first->step;
}

std::optional<PlaceId> PlaceMemory::place_of(std::ptrdiff_t step) const {
  if (step < -kStepsOfSession) {
    const auto after = by_first_step_.upper_bound(step);
    if (after == by_first_step_.begin()) return std::nullopt;
    const auto& [first, session] = *std::prev(after);
    const auto index = static_cast<std::size_t>(step - first);
    return index < session->steps.size() ? std::optional(session->steps[index]) : std::nullopt;
  }
  if (earlier_.empty()) return std::nullopt;
  const std::ptrdiff_t wanted = step + earlier_.back().step + kStepsBetweenSessions;
  const auto found = std::ranges::lower_bound(earlier_, wanted, {}, &EarlierPlace::step);
  if (found == earlier_.end() || found->step != wanted) return std::nullopt;
  return static_cast<PlaceId>(found - earlier_.begin());
}

void PlaceMemory::add(const Detection& detection, const BinaryContent& content, Features features,
                      const cv::Mat& image) {
  if (!map_) {
    features_.push_back(std::move(features));
    return;
  }
  map_->add(detection, content, std::make_shared<const Features>(std::move(features)), image);
}

void PlaceMemory::remove(PlaceId place, bool is_in_view) {
  Held held;
  if (is_in_view) removed_[place] = std::make_shared<const Features>(features(place, held));
  try {
    if (map_) map_->remove(place);
  } catch (...) {
    removed_.erase(place);
    throw;
  }
  if (!map_) features_[static_cast<std::size_t>(place)] = {};
}

const Features& PlaceMemory::features(PlaceId place, Held& held) const {
  if (!removed_.empty()) {
    const auto found = removed_.find(place);
    if (found != removed_.end()) return *found->second;
  }
  if (!map_) return features_[static_cast<std::size_t>(place)];
  const std::scoped_lock lock(map_mutex_);
  held.push_back(map_->features(place));
  return *held.back();
}

}  // namespace loopbit
