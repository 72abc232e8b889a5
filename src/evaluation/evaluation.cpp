// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/evaluation.hpp"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

namespace loopbit {
namespace {

/// Runs by query, so that a long sequence is scored in linear time.
class RunsByQuery {
 public:
  explicit RunsByQuery(const std::vector<PlaceRun>& runs) {
    for (const PlaceRun& run : runs) runs_[run.query].push_back(run);
  }

  [[nodiscard]] bool has(int query) const { return runs_.contains(query); }

  [[nodiscard]] bool has(int query, int match) const {
    const auto found = runs_.find(query);
    return found != runs_.end() &&
           std::any_of(found->second.begin(), found->second.end(), [&](const PlaceRun& run) {
             return run.first <= match && match <= run.last;
           });
  }

 private:
  std::unordered_map<int, std::vector<PlaceRun>> runs_;
};

}  // namespace

double DecisionCounts::recall() const {
  return positives == 0 ? 0.0 : static_cast<double>(right) / positives;
}

double DecisionCounts::precision() const {
  return right + wrong == 0 ? 1.0 : static_cast<double>(right) / (right + wrong);
}

DecisionCounts count_decisions(std::span<const Detection> detections, const GroundTruth& truth) {
  const RunsByQuery same_place(truth.same_place);
  const RunsByQuery near_place(truth.near_place);
  const std::unordered_set<int> ignored(truth.ignored.begin(), truth.ignored.end());
  DecisionCounts counts;
  for (const Detection& detection : detections) {
    if (ignored.contains(detection.frame)) {
      ++counts.ignored;
      continue;
    }
    if (same_place.has(detection.frame)) ++counts.positives;
    if (detection.status != Status::loop) continue;
    if (same_place.has(detection.frame, *detection.match)) {
      ++counts.right;
    } else if (near_place.has(detection.frame, *detection.match)) {
      ++counts.tolerated;
    } else {
      ++counts.wrong;
    }
  }
  return counts;
}

}  // namespace loopbit
