// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include "loopbit/evaluation.hpp"

namespace loopbit {
namespace {

using Json = nlohmann::ordered_json;

void add_lists(Json& json, const Evaluation& evaluation) {
  json["curve"] = Json::array();
  for (const CurvePoint& point : evaluation.curve) {
    json["curve"].push_back({{"score", point.score},
                             {"right", point.right},
                             {"wrong", point.wrong},
                             {"precision", point.precision},
                             {"recall", point.recall}});
  }
  json["wrong_loops"] = Json::array();
  for (const ReportedMatch& match : evaluation.wrong_loops) {
    json["wrong_loops"].push_back(
        {{"query", match.query}, {"match", match.match}, {"score", match.score}});
  }
  json["missed"] = evaluation.missed;
}

}  // namespace

std::string to_json(const Evaluation& evaluation, bool full) {
  const DecisionCounts& decision = evaluation.decision;
  const PairCounts& pairs = evaluation.pairs;
  const Interval interval = wilson_interval(decision.right, decision.right + decision.wrong);
  const std::string& protocol = evaluation.options.protocol;
  Json json{{"protocol", protocol.empty() ? Json() : Json(protocol)},
            {"tolerance_frames", evaluation.options.tolerance_frames},
            {"positives", decision.positives},
            {"right", decision.right},
            {"tolerated", decision.tolerated},
            {"wrong", decision.wrong},
            {"ignored", decision.ignored},
            {"recall", decision.recall()},
            {"precision", decision.precision()},
            {"precision_interval", {interval.low, interval.high}},
            {"recall_at_full_precision", evaluation.recall_at_full_precision},
            {"score_at_full_precision", nullptr},
            {"average_precision", evaluation.average_precision},
            {"pairs",
             {{"positives", pairs.positives},
              {"found", pairs.found},
              {"right", pairs.right},
              {"wrong", pairs.wrong},
              {"recall", pairs.recall()},
              {"precision", pairs.precision()}}}};
  if (evaluation.score_at_full_precision) {
    json["score_at_full_precision"] = *evaluation.score_at_full_precision;
  }
  if (full) add_lists(json, evaluation);
  return json.dump(2);
}

}  // namespace loopbit
