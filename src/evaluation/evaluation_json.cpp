// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include "loopbit/evaluation.hpp"
#include "loopbit/evaluation_fields.hpp"
#include "loopbit/json_fields.hpp"

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
  Json json;
  JsonWriter writer(json);
  transfer_evaluation(writer, "", evaluation);
  if (full) add_lists(json, evaluation);
  return json.dump(2);
}

}  // namespace loopbit
