// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "stored_features.hpp"

#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {

void StoredFeatures::begin(const std::string& path) {
  if (has_begun_) {
    throw Error(
        ErrorKind::option,
        fmt::format("map is '{}', which has a detector; open it again for another one.", path));
  }
  has_begun_ = true;
}

std::shared_ptr<const Features> StoredFeatures::get(PlaceId place, Damage& damage) {
  if (auto cached = cache_.find(place)) return cached;
  const StoredPlace& stored = places_.at(static_cast<std::size_t>(place));
  if (stored.id == kNoRow) return std::make_shared<const Features>();
  auto read = reader_.read(stored.id, stored.at, damage);
  auto features = std::make_shared<const Features>(read ? std::move(*read) : Features{});
  cache_.add(place, features);
  return features;
}

}  // namespace loopbit
