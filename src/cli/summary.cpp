// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "summary.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "loopbit/finished_run.hpp"
#include "loopbit/printable.hpp"
#include "loopbit/revisits.hpp"

namespace loopbit::cli {
namespace {

std::ptrdiff_t count(const std::vector<Detection>& detections, Status status) {
  return std::count_if(detections.begin(), detections.end(),
                       [&](const Detection& d) { return d.status == status; });
}

/// What later frames changed. `rejected`: withdrawn by the pose graph.
void print_changes(const std::vector<Detection>& detections, std::size_t rejected) {
  std::size_t late = 0;
  std::size_t withdrawn = 0;
  for (const Detection& d : detections) {
    late += d.late_loops.size();
    withdrawn += d.withdrawn_loops.size();
  }
  if (late > 0) fmt::print("  {:>9} more found late, once the path was sure\n", late);
  if (withdrawn > rejected) {
    fmt::print("  {:>9} withdrawn by later frames\n", withdrawn - rejected);
  }
}

/// What the pose graph made of the loops, and of the trajectory.
void print_correction(const Correction& correction, const std::string& folder) {
  fmt::print("graph      {} kept, {} rejected and withdrawn{}\n",
             counted(correction.kept(), "loop"), correction.rejected(), evidence_text(correction));
  if (correction.unjudged > 0) {
    fmt::print("           not judged: {} of frames without odometry\n",
               counted(correction.unjudged, "loop"));
  }
  if (correction.odometry_error_m && correction.corrected_error_m) {
    fmt::print("           trajectory error: {:.3f} m by odometry, {:.3f} m corrected\n",
               *correction.odometry_error_m, *correction.corrected_error_m);
  }
  fmt::print("           {0}/corrected.tum, {0}/graph.g2o, {0}/judged_loops.csv\n",
             printable(folder));
}

/// How often frames that found nothing did so, and what that means, in the order of the steps.
void print_reasons(const std::vector<Detection>& detections) {
  constexpr std::pair<Status, const char*> kReasons[] = {
      {Status::no_earlier_place, "only recent places to compare with"},
      {Status::no_similar_place, "no earlier place looks similar"},
      {Status::few_matches, "the best candidate shares too few features"},
      {Status::no_geometry, "features match, but not as one rigid scene"},
      {Status::low_score, "geometry found, but too little evidence"},
      {Status::ambiguous, "enough evidence, but other places share it"},
      {Status::unreachable, "evidence of a place out of reach, by odometry"},
      {Status::unreadable, "image unreadable"}};
  for (const auto& [status, meaning] : kReasons) {
    const auto frames = count(detections, status);
    if (frames > 0) fmt::print("  {:>9} {} ({})\n", frames, meaning, to_string(status));
  }
}

/// "300-410 is 46-150", the longest ones.
void print_revisits(const std::vector<Detection>& detections) {
  constexpr std::size_t kShown = 5;
  std::vector<Revisit> groups = revisits(match_list(detections));
  std::stable_sort(groups.begin(), groups.end(),
                   [](const Revisit& a, const Revisit& b) { return a.loops > b.loops; });
  const auto span = [](int first, int last) {
    return first == last ? fmt::format("{}", first) : fmt::format("{}-{}", first, last);
  };
  for (std::size_t i = 0; i < std::min(groups.size(), kShown); ++i) {
    const Revisit& one = groups[i];
    fmt::print("  {:>9} in a row: {} is {}\n", one.loops, span(one.first_query, one.last_query),
               span(one.first_match, one.last_match));
  }
  if (groups.size() > kShown) {
    fmt::print("            and {}\n", counted(groups.size() - kShown, "shorter revisit"));
  }
}

void print_score(const Evaluation& evaluation) {
  const DecisionCounts& score = evaluation.decision;
  fmt::print("truth      {} of {} revisits found: recall {}; {}: precision {}\n", score.right,
             score.positives, share_text(score.recall(), score.positives, 3),
             counted(score.wrong, "wrong loop"),
             share_text(score.precision(), score.right + score.wrong, 3));
  const DecisionCounts& late = evaluation.late;
  if (late.right != score.right || late.wrong != score.wrong) {
    fmt::print("           with late and without withdrawn loops: recall {}; {} wrong\n",
               share_text(late.recall(), late.positives, 3), late.wrong);
  }
  if (score.ignored > 0) {
    fmt::print("           not scored: {}\n", counted(score.ignored, "frame"));
  }
}

void print_times(const RunRecord& record, const std::vector<Detection>& detections) {
  const auto mean = [&](double StepTimes::*step) { return summarize(detections, step).mean; };
  fmt::print(
      "speed      {:.1f} frames/s with {}; mean per frame: content {:.2f} ms, "
      "retrieval {:.2f} ms, features {:.2f} ms, verification {:.2f} ms\n",
      static_cast<double>(detections.size()) / std::max(record.wall_s, 1e-9),
      counted(record.threads, "thread"), mean(&StepTimes::content_ms),
      mean(&StepTimes::retrieval_ms), mean(&StepTimes::features_ms),
      mean(&StepTimes::verification_ms));
}

}  // namespace

std::string evidence_text(const Correction& correction) {
  std::string text;
  for (std::size_t i = 0; i < kAllLoopVerdicts.size(); ++i) {
    const LoopVerdict verdict = kAllLoopVerdicts[i];
    if (verdict == LoopVerdict::kept || correction.by_verdict[i] == 0) continue;
    text += fmt::format("{}{} {}", text.empty() ? " (" : ", ", correction.by_verdict[i],
                        to_string(verdict));
  }
  return text.empty() ? text : text + ')';
}

std::string share_text(double share, std::int64_t whole, int decimals) {
  return whole == 0 ? "-" : fmt::format("{:.{}f}", share, decimals);
}

void print_summary(const RunOutcome& run, const std::string& report) {
  const RunRecord& record = run.record;
  const auto& detections = run.detections;
  fmt::print("input      {} ({}), {}{}{}\n", printable(record.input), printable(record.description),
             counted(detections.size(), "frame"),
             record.stopped_by == "interrupt" ? ", then interrupted" : "",
             record.early_end.empty() ? "" : ", then cut off");
  const auto loops = count(detections, Status::loop);
  const auto elsewhere = match_list(detections).elsewhere.size();
  fmt::print("loops      {} at a place seen before{}\n", counted(loops, "frame"),
             elsewhere == 0 ? "" : fmt::format(", {} in earlier sessions of the map", elsewhere));
  print_revisits(detections);
  const auto& correction = record.correction;
  print_changes(detections, correction ? static_cast<std::size_t>(correction->rejected()) : 0);
  print_reasons(detections);
  if (const std::string doubt = odometry_doubt(detections, correction); !doubt.empty()) {
    fmt::print("odometry   {}\n", doubt);
  }
  if (correction) print_correction(*correction, run.folder);
  if (record.score) print_score(*record.score);
  print_times(record, detections);
  fmt::print("written    {0}/loops.csv, {0}/late_loops.csv, {0}/run.json\n", printable(run.folder));
  if (!record.camera.empty()) {
    fmt::print("poses      {}/relative_poses.csv, with {}\n", printable(run.folder),
               printable(record.camera));
  }
  if (!record.map_path.empty()) {
    fmt::print("map        {}, session {}\n", printable(record.map_path), record.map_session);
  }
  if (!report.empty()) fmt::print("report     {}\n", printable(report));
}

}  // namespace loopbit::cli
