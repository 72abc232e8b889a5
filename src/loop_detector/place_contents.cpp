// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "place_contents.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>

namespace loopbit {
namespace {

bool is_far_from(const std::vector<Candidate>& taken, PlaceId place, int spacing) {
  return std::ranges::none_of(
      taken, [&](const Candidate& other) { return std::abs(other.place - place) < spacing; });
}

}  // namespace

std::vector<Candidate> PlaceContents::query(const BinaryContent& content, PlaceId end,
                                            const RetrievalOptions& options,
                                            const PlaceTest& is_allowed) const {
  auto similar = memory_.is_searched() ? query_map(content, end, options, is_allowed)
                                       : index_.query(content, end, options, nullptr, is_allowed);
  if (new_index_.size() == 0) return similar;
  PlaceTest is_new_allowed;
  if (is_allowed) is_new_allowed = [&](PlaceId place) { return is_allowed(-1 - place); };
  for (const auto& [place, value] :
       new_index_.query(content, new_index_.size(), options, nullptr, is_new_allowed)) {
    similar.push_back({-1 - place, value});
  }
  std::ranges::stable_sort(similar, std::greater{}, &Candidate::similarity);
  const auto most = static_cast<std::size_t>(options.max_candidates);
  similar.resize(std::min(most, similar.size()));
  return similar;
}

/// Takes the most similar places in order, as PlaceIndex does. A place that is taken keeps up to
/// 2 * (min_spacing - 1) others out, of which seldom more than half are among the most similar
/// ones. Where that is not enough, more are asked for.
std::vector<Candidate> PlaceContents::query_map(const BinaryContent& content, PlaceId end,
                                                const RetrievalOptions& options,
                                                const PlaceTest& is_allowed) const {
  validate(options, "retrieval");
  if (count(content) == 0) return {};
  const cv::Point2d query_center = center(content);
  const auto may_be_taken = [&](PlaceId place) {
    if (place >= end || (is_allowed && !is_allowed(place))) return false;
    if (options.max_center_distance_px >= kMaxCenterDistance_px) return true;
    const cv::Point2d apart = center(memory_.searched_content(place)) - query_center;
    return std::hypot(apart.x, apart.y) <= options.max_center_distance_px;
  };
  const auto most = static_cast<std::size_t>(options.max_candidates);
  for (std::size_t number = most * static_cast<std::size_t>(options.min_spacing);; number *= 2) {
    const PlaceSearch::Similar similar =
        memory_.most_similar(content, options.shift_tolerance_columns, number);
    std::vector<Candidate> taken;
    for (const Candidate& candidate : similar.places) {
      const bool is_similar =
          candidate.similarity > 0 && candidate.similarity >= options.min_similarity;
      if (!is_similar || taken.size() == most) return taken;
      if (is_far_from(taken, candidate.place, options.min_spacing) &&
          may_be_taken(candidate.place)) {
        taken.push_back(candidate);
      }
    }
    if (similar.is_all || taken.size() == most) return taken;
  }
}

}  // namespace loopbit
