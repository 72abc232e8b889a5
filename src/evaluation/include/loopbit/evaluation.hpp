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
  /// A match so near to a true earlier place is right, too; in frames of the truth's sequence.
  int tolerance_frames = 0;
  std::string protocol = {};  ///< its name, for the record; empty if it has none
};

/// What truth says about one reported match.
enum class Judgement {
  right,      ///< a true earlier place, or within the tolerance of one
  tolerated,  ///< near enough not to be wrong: listed as near_place
  wrong,      ///< neither
};

/// Ground truth, made ready to judge many matches. Queries and matches have the numbers of the
/// frames read, see GroundTruth::every. Cost of a question: the runs of its query.
class Judge {
 public:
  explicit Judge(const GroundTruth& truth, const EvaluationOptions& options = {});

  [[nodiscard]] Judgement judge(int query, int match) const;
  /// Whether truth lists the very frame `match` for `query`, whatever the tolerance.
  [[nodiscard]] bool is_true_pair(int query, int match) const;
  /// Whether `query` is scored and a match of it can be right: whether it is a revisit.
  [[nodiscard]] bool is_positive(int query) const;
  [[nodiscard]] bool is_ignored(int query) const;

 private:
  using RunsByQuery = std::unordered_map<std::int64_t, std::vector<PlaceRun>>;

  /// Calls holds(run) with the runs of `query` until one does.
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

/// How far the true share may be from the observed one.
struct Interval {
  double low = 0;
  double high = 1;
};

/// Wilson's interval (1927) for the share of `hits` in `trials`, at 95 %: also right where all or
/// none hit. [0, 1] without trials.
[[nodiscard]] Interval wilson_interval(std::int64_t hits, std::int64_t trials);

/// What the decisions of a detector come to, query by query. A query's best-scored accepted match
/// speaks for it (the first of equals).
struct DecisionCounts {
  int positives = 0;  ///< queries that are scored and have a true earlier place that was read
  int right = 0;
  int tolerated = 0;
  int wrong = 0;
  int ignored = 0;  ///< queries left out of the score

  /// right / positives; 0 without positives.
  [[nodiscard]] double recall() const;
  /// right / (right + wrong); 1 without loops.
  [[nodiscard]] double precision() const;
};

/// What they come to pair by pair: every accepted match counts, and so does every true pair of
/// frames, however many a query has.
struct PairCounts {
  std::int64_t positives = 0;  ///< true pairs
  std::int64_t found = 0;      ///< of those the accepted ones
  std::int64_t right = 0;  ///< accepted ones that are true or within the tolerance of a true one
  std::int64_t wrong = 0;

  /// found / positives; 0 without positives.
  [[nodiscard]] double recall() const;
  /// right / (right + wrong); 1 without loops.
  [[nodiscard]] double precision() const;
};

/// All queries whose best match, accepted or not, has at least this score.
struct CurvePoint {
  double score = 0;
  int right = 0;
  int wrong = 0;
  double precision = 1;
  double recall = 0;
};

/// How good a detector's matches are; see docs/evaluation.md.
struct Evaluation {
  EvaluationOptions options;
  DecisionCounts decision;  ///< as shipped
  PairCounts pairs;         ///< as shipped
  /// One point for each score that occurs, from the highest: equal scores are accepted all or none.
  std::vector<CurvePoint> curve;
  double recall_at_full_precision = 0;
  /// The lowest score with no wrong match at it or above; none if even the highest has one.
  std::optional<double> score_at_full_precision;
  double average_precision = 0;            ///< sum of precision times gain of recall over `curve`
  std::vector<ReportedMatch> wrong_loops;  ///< accepted, by query
  std::vector<int> missed;                 ///< positive queries without a right loop
};

/// Scores `list` against `truth`. Queries past the end of a list that has one (times_s) do not
/// count, nor those answered elsewhere (MatchList::elsewhere). Cost: sorting the matches.
Evaluation evaluate(const MatchList& list, const GroundTruth& truth,
                    const EvaluationOptions& options = {});

/// As JSON. `full` adds the curve, the wrong loops and the missed queries.
std::string to_json(const Evaluation& evaluation, bool full);

}  // namespace loopbit
