// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/judge.hpp"

#include <algorithm>

namespace loopbit {

Judge::Judge(const GroundTruth& truth, const EvaluationOptions& options)
    : tolerance_frames_(options.tolerance_frames),
      every_(truth.every),
      ignored_(truth.ignored.begin(), truth.ignored.end()),
      unknown_(truth.unknown.begin(), truth.unknown.end()) {
  for (const PlaceRun& run : truth.same_place) same_place_[run.query].push_back(run);
  for (const PlaceRun& run : truth.near_place) near_place_[run.query].push_back(run);
}

template <typename Holds>
bool Judge::any_run(const RunsByQuery& runs, int query, const Holds& holds) const {
  const auto found = runs.find(in_sequence(query));
  return found != runs.end() && std::any_of(found->second.begin(), found->second.end(), holds);
}

bool Judge::lists(const RunsByQuery& runs, int query, int match, std::int64_t tolerance) const {
  const std::int64_t place = in_sequence(match);
  return any_run(runs, query, [&](const PlaceRun& run) {
    return place >= run.first - tolerance && place <= run.last + tolerance;
  });
}

bool Judge::is_true_pair(int query, int match) const { return lists(same_place_, query, match, 0); }

Judgement Judge::judge(int query, int match) const {
  if (lists(same_place_, query, match, tolerance_frames_)) return Judgement::right;
  const bool is_near = unknown_.contains(in_sequence(match)) || lists(near_place_, query, match, 0);
  return is_near ? Judgement::tolerated : Judgement::wrong;
}

bool Judge::is_positive(int query) const {
  if (is_ignored(query)) return false;
  return any_run(same_place_, query, [&](const PlaceRun& run) {
    const std::int64_t last_read = (std::int64_t{run.last} + tolerance_frames_) / every_ * every_;
    return last_read >= std::int64_t{run.first} - tolerance_frames_;
  });
}

bool Judge::is_ignored(int query) const {
  const std::int64_t frame = in_sequence(query);
  return ignored_.contains(frame) || unknown_.contains(frame);
}

}  // namespace loopbit
