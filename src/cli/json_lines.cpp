// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "json_lines.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "loopbit/finished_run.hpp"
#include "loopbit/printable.hpp"

#include "process.hpp"

namespace loopbit::cli {
namespace {

using Line = nlohmann::ordered_json;

void print_now(const Line& line) {
  const std::string text = line.dump(-1, ' ', false, Line::error_handler_t::replace);
  fmt::print("{}\n", printable_json(text));
  flush_stdout();
}

}  // namespace

void JsonLines::add(const Detection& detection) {
  names_.push_back(detection.name);
  if (detection.status != Status::loop) return;
  Line line{{"type", "loop"}, {"frame", detection.frame}, {"name", detection.name}};
  if (detection.timestamp_s) line["timestamp_s"] = *detection.timestamp_s;
  if (detection.match) {
    line["match"] = *detection.match;
    line["match_name"] = names_.at(static_cast<std::size_t>(*detection.match));
  } else if (detection.earlier_match) {
    line["earlier_match"] = {{"session", detection.earlier_match->session},
                             {"frame", detection.earlier_match->frame}};
  }
  line["score"] = detection.score;
  line["similarity"] = detection.similarity;
  line["matches"] = detection.matches;
  line["inliers"] = detection.inliers;
  print_now(line);
}

void JsonLines::finish(const RunOutcome& run, const std::string& report) {
  Line line{{"type", "summary"}, {"folder", run.folder}};
  if (!report.empty()) line["report"] = report;
  line["run"] = Line::parse(read_run(run.folder).record_json);
  print_now(line);
}

}  // namespace loopbit::cli
