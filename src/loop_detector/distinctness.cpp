// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "distinctness.hpp"

#include <cstdlib>
#include <limits>

namespace loopbit {
namespace {

constexpr std::ptrdiff_t kSamePlaceSteps = 6;

/// In how many other places a feature of the query was found.
struct Elsewhere {
  int count = 0;
  int latest = 0;  ///< the number of the last one, from 1
};

}  // namespace

Spot spot_of(std::ptrdiff_t step, const KnownLoops& loops) {
  return {step, loops.first_visit(step)};
}

bool is_same_place(const Spot& a, const Spot& b) {
  return std::abs(a.step - b.step) < kSamePlaceSteps ||
         std::abs(a.first_visit - b.first_visit) < kSamePlaceSteps;
}

double distinctness(const Sighting& sighting, const std::vector<Sighting>& all) {
  if (sighting.inliers.empty()) return 1;
  std::vector<Elsewhere> found;
  int place = 0;
  std::ptrdiff_t latest_visit = std::numeric_limits<std::ptrdiff_t>::min() / 2;
  for (const Sighting& other : all) {
    if (is_same_place(other.spot, sighting.spot)) continue;
    if (other.spot.first_visit - latest_visit >= kSamePlaceSteps) ++place;
    latest_visit = other.spot.first_visit;
    for (const Match& match : other.inliers) {
      const auto feature = static_cast<std::size_t>(match.query);
      if (feature >= found.size()) found.resize(feature + 1);
      if (found[feature].latest == place) continue;
      found[feature] = {found[feature].count + 1, place};
    }
  }
  double sum = 0;
  for (const Match& match : sighting.inliers) {
    const auto feature = static_cast<std::size_t>(match.query);
    sum += feature < found.size() ? 1.0 / (1 + found[feature].count) : 1.0;
  }
  return sum / static_cast<double>(sighting.inliers.size());
}

}  // namespace loopbit
