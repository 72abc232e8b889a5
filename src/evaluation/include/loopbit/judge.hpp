// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "loopbit/evaluation.hpp"
#include "loopbit/ground_truth.hpp"

namespace loopbit {

/// The judgement of one reported match.
enum class Judgement {
  right,      ///< a true earlier place, or within the tolerance of one
  tolerated,  ///< listed as near_place: neither right nor wrong
  wrong,      ///< any other match
};

/// Ground truth, indexed to judge many matches. Queries and matches are numbered by the frames
/// read; see GroundTruth::every. Cost per call: linear in the runs of the query.
class Judge {
 public:
  explicit Judge(const GroundTruth& truth, const EvaluationOptions& options = {});

  [[nodiscard]] Judgement judge(int query, int match) const;
  /// Whether truth lists exactly the frame `match` for `query`. The tolerance is ignored.
  [[nodiscard]] bool is_true_pair(int query, int match) const;
  /// Whether `query` is a revisit: it is scored, and it has a true earlier place.
  [[nodiscard]] bool is_positive(int query) const;
  [[nodiscard]] bool is_ignored(int query) const;

 private:
  using RunsByQuery = std::unordered_map<std::int64_t, std::vector<PlaceRun>>;

  /// Whether holds(run) is true for any run of `query`.
  template <typename Holds>
  [[nodiscard]] bool any_run(const RunsByQuery& runs, int query, const Holds& holds) const;
  [[nodiscard]] bool lists(const RunsByQuery& runs, int query, int match,
                           std::int64_t tolerance) const;
  [[nodiscard]] std::int64_t in_sequence(int frame) const { return std::int64_t{frame} * every_; }

  int tolerance_frames_;
  int every_;
  RunsByQuery same_place_;
  RunsByQuery near_place_;
  std::unordered_set<std::int64_t> ignored_;
  std::unordered_set<std::int64_t> unknown_;
};

}  // namespace loopbit
