// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "shared_map.hpp"

namespace loopbit::python {

void SharedMap::check_options(const LoopDetectorOptions& options) {
  const auto guard = lock();
  storage().check_options(options);
}

PlaceSearch* SharedMap::place_search() {
  const auto guard = lock();
  return storage().place_search() ? this : nullptr;
}

void SharedMap::for_each_place(double unmoved, const PlaceSearch::Visit& visit) {
  const auto guard = lock();
  storage().place_search()->for_each_place(unmoved, visit);
}

SharedMap::Similar SharedMap::most_similar(const BinaryContent& content,
                                           int shift_tolerance_columns, std::size_t number) {
  const auto guard = lock();
  return storage().place_search()->most_similar(content, shift_tolerance_columns, number);
}

BinaryContent SharedMap::content(PlaceId place) {
  const auto guard = lock();
  return storage().place_search()->content(place);
}

void SharedMap::for_each_earlier_place(const Visit& visit) {
  const auto guard = lock();
  storage().for_each_earlier_place(visit);
}

void SharedMap::for_each_earlier_loop(const VisitLoop& visit) {
  const auto guard = lock();
  storage().for_each_earlier_loop(visit);
}

std::int64_t SharedMap::epoch() {
  const auto guard = lock();
  return storage().epoch();
}

MapNews SharedMap::news() {
  const auto guard = lock();
  return storage().news();
}

std::shared_ptr<const Features> SharedMap::features(PlaceId place) {
  const auto guard = lock();
  return storage().features(place);
}

void SharedMap::add(const Detection& detection, const BinaryContent& content,
                    std::shared_ptr<const Features> features, const cv::Mat& image) {
  const auto guard = lock();
  storage().add(detection, content, std::move(features), image);
}

void SharedMap::remove(PlaceId place) {
  const auto guard = lock();
  storage().remove(place);
}

void SharedMap::reject(const SessionFrame& query, const SessionFrame& match) {
  const auto guard = lock();
  storage().reject(query, match);
}

std::optional<LoopDetectorOptions> SharedReader::options() const {
  const auto guard = lock();
  if (map_.sessions().empty()) return std::nullopt;
  return map_.options();
}

std::optional<LoopDetectorOptions> SharedShards::options() const {
  const auto guard = lock();
  return map_.options();
}

}  // namespace loopbit::python
