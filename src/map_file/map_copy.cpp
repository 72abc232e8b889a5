// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "map_copy.hpp"

#include <utility>

#include "map_schema.hpp"

namespace loopbit {
namespace {

constexpr std::int64_t kPlacesPerTransaction = 2048;

}  // namespace

MapCopy::MapCopy(const Database& to, std::map<int, int> numbers)
    : rows_(to), numbers_(std::move(numbers)) {}

void MapCopy::copy_session(MapSession session) {
  session.session = numbers_.at(session.session);
  rows_.write(session);
}

bool MapCopy::copy_place(const MapPlace& place, const Features& features, const Image& image) {
  MapPlace copy = place;
  if (!renumber(copy.at)) return false;
  rows_.write(copy, features);
  if (image) rows_.write_image(copy, *image);
  return true;
}

bool MapCopy::copy_loop(MapLoop loop) {
  if (!renumber(loop.query) || !renumber(loop.match)) return false;
  rows_.write(loop);
  return true;
}

bool MapCopy::renumber(SessionFrame& at) const {
  const auto found = numbers_.find(at.session);
  if (found == numbers_.end()) return false;
  at.session = found->second;
  return true;
}

MapCheck copy_whole(MapReader& from, const CopyPlan& plan, const Database& to) {
  std::map<int, int> numbers;
  for (const MapSession& session : plan.sessions) numbers[session.session] = session.session;
  MapCopy copy(to, std::move(numbers));
  MapCheck counts;
  std::optional<Commit> commit(std::in_place, to);
  for (const MapSession& session : plan.sessions) copy.copy_session(session);
  counts.sessions = static_cast<std::int64_t>(plan.sessions.size());
  from.for_each_place([&](const MapPlace& place) {
    if (!plan.keeps_place(place)) return;
    const auto features = from.features_of(place);
    const Image image = plan.keeps_images ? from.image_of(place) : std::nullopt;
    if (!features || !copy.copy_place(place, *features, image)) return;
    counts.images += image.has_value();
    if (++counts.places % kPlacesPerTransaction == 0) {
      commit->end();
      commit.emplace(to);
    }
  });
  for (const MapLoop& loop : from.loops()) counts.loops += copy.copy_loop(loop);
  commit->end();
  return counts;
}

}  // namespace loopbit
