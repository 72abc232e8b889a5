// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "found_places.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace loopbit {
namespace {

bool are_closer(const Candidate& a, const Candidate& b, int spacing) {
  return std::abs(a.place - b.place) < spacing;
}

}  // namespace

FoundPlaces::FoundPlaces(const RetrievalOptions& options)
    : max_candidates_(static_cast<std::size_t>(options.max_candidates)),
      min_spacing_(options.min_spacing),
      floor_{std::numeric_limits<PlaceId>::max(), options.min_similarity} {}

void FoundPlaces::add(const Candidate& candidate) {
  found_.push_back(candidate);
  raise_floor(candidate);
}

void FoundPlaces::raise_floor(const Candidate& candidate) {
  const int spacing = 2 * min_spacing_ - 1;
  const auto is_close = [&](const Candidate& other) {
    return are_closer(candidate, other, spacing);
  };
  const auto first_close = std::find_if(apart_.begin(), apart_.end(), is_close);
  if (first_close != apart_.end()) {
    if (!candidate.comes_before(*first_close)) return;
    if (std::any_of(first_close + 1, apart_.end(), is_close)) return;
    *first_close = candidate;
  } else if (apart_.size() < max_candidates_) {
    apart_.push_back(candidate);
  } else {
    const auto last = std::ranges::max_element(apart_, &Candidate::comes_before);
    if (!candidate.comes_before(*last)) return;
    *last = candidate;
  }
  if (apart_.size() < max_candidates_) return;
  const Candidate last = *std::ranges::max_element(apart_, &Candidate::comes_before);
  if (last.comes_before(floor_)) floor_ = last;
}

std::vector<Candidate> FoundPlaces::answer() && {
  std::ranges::sort(found_, &Candidate::comes_before);
  std::vector<Candidate> taken;
  for (const Candidate& candidate : found_) {
    if (taken.size() == max_candidates_) break;
    const bool is_too_close = std::any_of(taken.begin(), taken.end(), [&](const Candidate& other) {
      return are_closer(candidate, other, min_spacing_);
    });
    if (!is_too_close) taken.push_back(candidate);
  }
  return taken;
}

}  // namespace loopbit
