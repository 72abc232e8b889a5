// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "loopbit/ground_truth.hpp"
#include "loopbit/match_list.hpp"

namespace loopbit {

struct EvaluationOptions {
  /// A match within this distance of a true earlier place is also right; in frames of the truth.
  int tolerance_frames = 0;
  std::string protocol = {};  ///< name of the protocol, for the record; may be empty
};

/// A confidence interval.
struct Interval {
  double low = 0;
  double high = 1;
};

/// Counts of a detector's decisions, per query. Only the accepted match with the highest score of a
/// query counts (the first of equal ones).
struct DecisionCounts {
  int positives = 0;  ///< scored queries with a true earlier place that was read
  int right = 0;
  int tolerated = 0;
  int wrong = 0;
  int ignored = 0;  ///< queries that are not scored

  /// right / positives; 0 without positives.
  [[nodiscard]] double recall() const;
  /// right / (right + wrong); 1 without loops.
  [[nodiscard]] double precision() const;
  /// Wilson's interval (1927) of the precision, at 95 %. It is valid even if all or none of the
  /// loops are right. [0, 1] without loops.
  [[nodiscard]] Interval precision_interval() const;
};

/// Counts of a detector's decisions, per pair of frames. Every accepted match counts, and every
/// true pair, even several per query.
struct PairCounts {
  std::int64_t positives = 0;  ///< true pairs
  std::int64_t found = 0;      ///< true pairs that were accepted
  std::int64_t right = 0;  ///< accepted pairs that are true or within the tolerance of a true pair
  std::int64_t wrong = 0;

  /// found / positives; 0 without positives.
  [[nodiscard]] double recall() const;
  /// right / (right + wrong); 1 without loops.
  [[nodiscard]] double precision() const;
};

/// Counts over all queries whose best match, accepted or not, has at least this score.
struct CurvePoint {
  double score = 0;
  int right = 0;
  int wrong = 0;
  double precision = 1;
  double recall = 0;
};

/// The score of a detector's matches; see docs/evaluation.md.
struct Evaluation {
  EvaluationOptions options;
  DecisionCounts decision;  ///< with the detector's own threshold
  /// The same with loops that were found late, and without those that were withdrawn; see
  /// MatchList::changes.
  DecisionCounts late;
  PairCounts pairs;  ///< with the detector's own threshold
  /// One point per distinct score, from the highest. Equal scores are accepted together.
  std::vector<CurvePoint> curve;
  double recall_at_full_precision = 0;
  /// The lowest score with no wrong match at or above it; none if the highest score is wrong.
  std::optional<double> score_at_full_precision;
  double average_precision = 0;            ///< sum of precision x gain of recall over `curve`
  std::vector<ReportedMatch> wrong_loops;  ///< accepted, by query
  std::vector<int> missed;                 ///< positive queries without a right loop
};

/// Scores `list` against `truth`. Queries after the end of the list do not count if the end is
/// known (times_s), nor do queries matched elsewhere (MatchList::elsewhere). Cost: sorting the
/// matches.
Evaluation evaluate(const MatchList& list, const GroundTruth& truth,
                    const EvaluationOptions& options = {});

/// The evaluation as JSON. `full` adds the curve, the wrong loops and the missed queries.
std::string to_json(const Evaluation& evaluation, bool full);

}  // namespace loopbit
