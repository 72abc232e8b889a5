// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "loopbit/ground_truth.hpp"
#include "loopbit/match_list.hpp"

namespace loopbit {

struct EvaluationOptions {
  /// A match within this distance of a true earlier place is also right; in frames of the truth.
  int tolerance_frames = 0;
  std::string protocol = {};  ///< name of the protocol, for the record; may be empty
};

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

/// A confidence interval.
struct Interval {
  double low = 0;
  double high = 1;
};

/// Wilson's interval (1927) for the share of `hits` in `trials`, at 95 %. It is valid even if all
/// or none of the trials hit. [0, 1] without trials.
[[nodiscard]] Interval wilson_interval(std::int64_t hits, std::int64_t trials);

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
  PairCounts pairs;         ///< with the detector's own threshold
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
