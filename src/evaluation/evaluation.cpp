// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/judge.hpp"

namespace loopbit {
namespace {

double share(std::int64_t part, std::int64_t whole, double of_nothing) {
  return whole == 0 ? of_nothing : static_cast<double>(part) / static_cast<double>(whole);
}

/// The match with the highest score of each query, the first of equal ones; ordered by query.
std::map<int, ReportedMatch> best_by_query(const std::vector<ReportedMatch>& matches,
                                           bool accepted_only) {
  std::map<int, ReportedMatch> best;
  for (const ReportedMatch& match : matches) {
    if (accepted_only && !match.is_loop) continue;
    const auto [entry, is_new] = best.try_emplace(match.query, match);
    if (!is_new && match.score > entry->second.score) entry->second = match;
  }
  return best;
}

/// True pairs of a query and an earlier frame among scored queries. Runs may overlap.
std::int64_t count_pairs(std::vector<PlaceRun> runs) {
  std::sort(runs.begin(), runs.end(), [](const PlaceRun& a, const PlaceRun& b) {
    return std::pair(a.query, a.first) < std::pair(b.query, b.first);
  });
  std::int64_t pairs = 0;
  std::int64_t next = 0;  // the first frame that is not counted yet
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i == 0 || runs[i].query != runs[i - 1].query) next = runs[i].first;
    next = std::max<std::int64_t>(next, runs[i].first);
    const std::int64_t end = std::int64_t{runs[i].last} + 1;
    pairs += std::max<std::int64_t>(0, end - next);
    next = std::max(next, end);
  }
  return pairs;
}

/// Accumulates one evaluation.
class Scorer {
 public:
  Scorer(const MatchList& list, const GroundTruth& truth, const EvaluationOptions& options)
      : list_(list),
        judge_(truth, options),
        elsewhere_(list.elsewhere.begin(), list.elsewhere.end()) {
    result_.options = options;
    check_frames(truth);
    for (const PlaceRun& run : truth.same_place) {
      const int query = run.query / truth.every;
      if (run.query % truth.every != 0 || !is_scored(query)) continue;
      if (judge_.is_positive(query)) positives_.insert(query);
    }
    std::vector<PlaceRun> read = every_nth(truth, truth.every).same_place;
    std::erase_if(read, [&](const PlaceRun& run) { return !is_scored(run.query); });
    result_.pairs.positives = count_pairs(std::move(read));
    result_.decision.positives = static_cast<int>(positives_.size());
    result_.decision.ignored = count_ignored(truth);
  }

  Evaluation score() && {
    score_decisions();
    score_pairs();
    sweep();
    return std::move(result_);
  }

 private:
  /// Throws if the list has frames beyond those that the truth covers.
  void check_frames(const GroundTruth& truth) const {
    if (truth.frames <= 0) return;
    for (const ReportedMatch& match : list_.matches) {
      if (std::int64_t{match.query} * truth.every < truth.frames) continue;
      throw Error(ErrorKind::input,
                  fmt::format("Query {} is beyond the {} frames of the ground truth; give the "
                              "ground truth of this sequence, and say which frames were read.",
                              match.query, truth.frames));
    }
  }

  [[nodiscard]] bool is_past_end(int query) const {
    return !list_.times_s.empty() && static_cast<std::size_t>(query) >= list_.times_s.size();
  }

  [[nodiscard]] bool is_scored(int query) const {
    return !is_past_end(query) && !judge_.is_ignored(query) && !elsewhere_.contains(query);
  }

  /// The frames of the list if it lists frames, otherwise its queries.
  [[nodiscard]] int count_ignored(const GroundTruth& truth) const {
    std::set<int> ignored = elsewhere_;
    if (list_.times_s.empty()) {
      for (const ReportedMatch& match : list_.matches) {
        if (judge_.is_ignored(match.query)) ignored.insert(match.query);
      }
    } else {
      for (const auto* frames : {&truth.ignored, &truth.unknown}) {
        for (const int frame : *frames) {
          const int query = frame / truth.every;
          if (frame % truth.every == 0 && !is_past_end(query)) ignored.insert(query);
        }
      }
    }
    return static_cast<int>(ignored.size());
  }

  void score_decisions() {
    std::set<int> found;
    for (const auto& [query, match] : best_by_query(list_.matches, true)) {
      if (!is_scored(query)) continue;
      switch (judge_.judge(query, match.match)) {
        case Judgement::right:
          ++result_.decision.right;
          found.insert(query);
          break;
        case Judgement::tolerated:
          ++result_.decision.tolerated;
          break;
        case Judgement::wrong:
          ++result_.decision.wrong;
          result_.wrong_loops.push_back(match);
          break;
      }
    }
    std::set_difference(positives_.begin(), positives_.end(), found.begin(), found.end(),
                        std::back_inserter(result_.missed));
  }

  void score_pairs() {
    std::set<std::pair<int, int>> seen;
    for (const ReportedMatch& match : list_.matches) {
      if (!match.is_loop || !is_scored(match.query)) continue;
      if (!seen.emplace(match.query, match.match).second) continue;
      const Judgement judgement = judge_.judge(match.query, match.match);
      if (judgement == Judgement::right) ++result_.pairs.right;
      if (judge_.is_true_pair(match.query, match.match)) ++result_.pairs.found;
      if (judgement == Judgement::wrong) ++result_.pairs.wrong;
    }
  }

  void sweep() {
    std::vector<ReportedMatch> ranked;
    for (const auto& [query, match] : best_by_query(list_.matches, false)) {
      if (is_scored(query)) ranked.push_back(match);
    }
    std::stable_sort(ranked.begin(), ranked.end(),
                     [](const auto& a, const auto& b) { return a.score > b.score; });
    CurvePoint point;
    for (std::size_t i = 0; i < ranked.size(); ++i) {
      const Judgement judgement = judge_.judge(ranked[i].query, ranked[i].match);
      if (judgement == Judgement::right) ++point.right;
      if (judgement == Judgement::wrong) ++point.wrong;
      const bool is_last_of_equals =
          i + 1 == ranked.size() || ranked[i + 1].score < ranked[i].score;
      if (is_last_of_equals) add_point(point, ranked[i].score);
    }
  }

  void add_point(CurvePoint point, double score) {
    point.score = score;
    point.precision = share(point.right, point.right + point.wrong, 1.0);
    point.recall = share(point.right, result_.decision.positives, 0.0);
    const double recall_before = result_.curve.empty() ? 0.0 : result_.curve.back().recall;
    result_.average_precision += point.precision * (point.recall - recall_before);
    if (point.wrong == 0) {
      result_.recall_at_full_precision = point.recall;
      result_.score_at_full_precision = score;
    }
    result_.curve.push_back(point);
  }

  const MatchList& list_;
  Judge judge_;
  std::set<int> elsewhere_;
  std::set<int> positives_;
  Evaluation result_;
};

}  // namespace

double DecisionCounts::recall() const { return share(right, positives, 0.0); }
double DecisionCounts::precision() const { return share(right, right + wrong, 1.0); }

Interval DecisionCounts::precision_interval() const {
  const int loops = right + wrong;
  if (loops == 0) return {};
  constexpr double kZ = 1.959963984540054;  // the normal distribution's 97.5 % quantile
  const double n = loops;
  const double p = right / n;
  const double scale = 1.0 / (1.0 + kZ * kZ / n);
  const double middle = scale * (p + kZ * kZ / (2.0 * n));
  const double half = scale * kZ * std::sqrt(p * (1.0 - p) / n + kZ * kZ / (4.0 * n * n));
  return {std::max(0.0, middle - half), std::min(1.0, middle + half)};
}

double PairCounts::recall() const { return share(found, positives, 0.0); }
double PairCounts::precision() const { return share(right, right + wrong, 1.0); }

Evaluation evaluate(const MatchList& list, const GroundTruth& truth,
                    const EvaluationOptions& options) {
  Evaluation evaluation = Scorer(list, truth, options).score();
  evaluation.late = list.changes.empty()
                        ? evaluation.decision
                        : Scorer(with_changes(list), truth, options).score().decision;
  return evaluation;
}

}  // namespace loopbit
