// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "json_lines.hpp"

#include <nlohmann/json.hpp>

#include "loopbit/finished_run.hpp"

#include "process.hpp"

namespace loopbit::cli {
namespace {

using Line = nlohmann::ordered_json;

void print_now(const Line& line) {
  print_document(line, -1);
  flush_stdout();
}

/// `Found`: a Detection or a LateLoop.
template <typename Found>
void add_match(Line& line, const Found& found, const std::vector<std::string>& names) {
  if (found.match) {
    line["match"] = *found.match;
    line["match_name"] = names.at(static_cast<std::size_t>(*found.match));
  } else if (found.earlier_match) {
    line["earlier_match"] = {{"session", found.earlier_match->session},
                             {"frame", found.earlier_match->frame}};
  }
}

void print_late(const char* type, const std::vector<LateLoop>& loops,
                const std::vector<std::string>& names) {
  for (const LateLoop& loop : loops) {
    Line line{{"type", type},
              {"frame", loop.frame},
              {"name", names.at(static_cast<std::size_t>(loop.frame))}};
    add_match(line, loop, names);
    line["score"] = loop.score;
    line["similarity"] = loop.similarity;
    line["reported_at"] = names.size() - 1;
    print_now(line);
  }
}

}  // namespace

void JsonLines::add(const Detection& detection) {
  names_.push_back(detection.name);
  print_late("withdrawn", detection.withdrawn_loops, names_);
  print_late("late", detection.late_loops, names_);
  if (detection.status != Status::loop) return;
  Line line{{"type", "loop"}, {"frame", detection.frame}, {"name", detection.name}};
  if (detection.timestamp_s) line["timestamp_s"] = *detection.timestamp_s;
  add_match(line, detection, names_);
  if (detection.epoch > 0) line["epoch"] = detection.epoch;
  line["score"] = detection.score;
  if (const auto& terms = detection.terms) {
    line["terms"] = {{"votes", terms->votes},
                     {"geometry", terms->geometry},
                     {"path", terms->path},
                     {"rivals", terms->rivals},
                     {"prior", terms->prior}};
  }
  line["similarity"] = detection.similarity;
  line["matches"] = detection.matches;
  line["inliers"] = detection.inliers;
  print_now(line);
}

void JsonLines::withdraw(const std::vector<LateLoop>& loops) const {
  print_late("withdrawn", loops, names_);
}

void JsonLines::finish(const RunOutcome& run, const std::string& report) {
  Line line{{"type", "summary"}, {"folder", run.folder}};
  if (!report.empty()) line["report"] = report;
  line["run"] = Line::parse(read_run(run.folder).record_json);
  print_now(line);
}

}  // namespace loopbit::cli
