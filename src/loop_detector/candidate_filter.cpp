// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "candidate_filter.hpp"

#include <algorithm>
#include <memory>
#include <span>
#include <utility>
#include <variant>

namespace loopbit {
namespace {

/// Places of MapStorage::news() have negative numbers.
std::size_t index_of(PlaceId place) {
  return place < 0 ? 2 * static_cast<std::size_t>(-(place + 1)) + 1
                   : 2 * static_cast<std::size_t>(place);
}

bool is_marked(PlaceId place, const std::vector<bool>& marks) {
  const std::size_t index = index_of(place);
  return index < marks.size() && marks[index];
}

void mark(PlaceId place, std::vector<bool>& marks) {
  const std::size_t index = index_of(place);
  if (index >= marks.size()) marks.resize(index + 1);
  marks[index] = true;
}

}  // namespace

bool CandidateFilter::is_removed(PlaceId place) const { return is_marked(place, removed_); }

void CandidateFilter::remove(PlaceId place) { mark(place, removed_); }

bool CandidateFilter::is_rejected(PlaceId place) const {
  return std::any_of(rejected_.begin(), rejected_.end(),
                     [&](const Spot& spot) { return is_same_place(spot, places_.spot_of(place)); });
}

PlaceTest CandidateFilter::wanted(const AllowedPlaces& allowed) const {
  if (const auto* asks = std::get_if<std::function<bool(const SessionFrame&)>>(&allowed)) {
    if (!*asks) return {};
    return [this, asks](PlaceId place) { return (*asks)(places_.origin(place)); };
  }
  const auto* list = std::get_if<std::span<const SessionFrame>>(&allowed);
  if (list == nullptr) return {};
  const auto is_listed = std::make_shared<std::vector<bool>>();  // copies of the test share it
  for (const SessionFrame& at : *list) {
    if (const auto place = places_.find(at)) mark(*place, *is_listed);
  }
  return [is_listed](PlaceId place) { return is_marked(place, *is_listed); };
}

PlaceTest CandidateFilter::test(const AllowedPlaces& allowed, bool changes_view) const {
  PlaceTest is_wanted = wanted(allowed);
  const bool has_rejected = !changes_view && !rejected_.empty();
  if (removed_.empty() && !has_rejected) return is_wanted;
  return [this, has_rejected, is_wanted = std::move(is_wanted)](PlaceId place) {
    if (is_removed(place) || (has_rejected && is_rejected(place))) return false;
    return !is_wanted || is_wanted(place);
  };
}

}  // namespace loopbit
