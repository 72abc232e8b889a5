// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "stored_features.hpp"

#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

std::size_t bytes_of(const Features& features) {
  return sizeof features + features.keypoints.size() * (sizeof(Keypoint) + sizeof(Descriptor));
}

}  // namespace

std::shared_ptr<const Features> FeatureCache::find(PlaceId place) {
  const auto found = at_.find(place);
  if (found == at_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found->second);
  return found->second->features;
}

void FeatureCache::add(PlaceId place, std::shared_ptr<const Features> features) {
  if (find(place)) return;
  std::list<Entry> entry;
  entry.push_front({place, std::move(features)});
  at_.emplace(place, entry.begin());
  entries_.splice(entries_.begin(), entry);
  bytes_ += bytes_of(*entries_.front().features);
  while (bytes_ > max_bytes_) {
    bytes_ -= bytes_of(*entries_.back().features);
    at_.erase(entries_.back().place);
    entries_.pop_back();
  }
}

void StoredFeatures::begin(const std::string& path) {
  if (has_begun_) {
    throw Error(
        ErrorKind::option,
        fmt::format("map is '{}', which has a detector; open it again for another one.", path));
  }
  has_begun_ = true;
}

std::shared_ptr<const Features> StoredFeatures::get(PlaceId place, Damage& damage,
                                                    FeatureReader& reader) {
  if (auto cached = cache_.find(place)) return cached;
  const StoredPlace& stored = this->stored(place);
  if (stored.id == kNoRow) return std::make_shared<const Features>();
  auto read = reader.read(stored.id, stored.at, damage);
  auto features = std::make_shared<const Features>(read ? std::move(*read) : Features{});
  cache_.add(place, features);
  return features;
}

}  // namespace loopbit
