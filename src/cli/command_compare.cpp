// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "loopbit/error.hpp"
#include "loopbit/evaluation.hpp"
#include "loopbit/printable.hpp"
#include "loopbit/run_record.hpp"
#include "loopbit/write_file.hpp"

#include "commands.hpp"
#include "curve_plot.hpp"
#include "process.hpp"
#include "run_list.hpp"
#include "session.hpp"
#include "summary.hpp"

namespace loopbit::cli {
namespace {

struct CompareFlags {
  std::vector<std::string> runs;
  std::string out;
  std::string plot;
  TruthFlags truth;
  ReportOptions report;
  bool json = false;
  bool open = false;
};

struct ComparedRun {
  std::string name;
  Evaluation evaluation;
  std::optional<TimeSummary> time;  ///< of all steps together; loopbit's runs only
};

/// Throws Error (kind input) where two runs are not about the same frames.
void check_same_frames(const ListedRun& a, const ListedRun& b) {
  const auto refuse = [&](const std::string& of_a, const std::string& of_b) {
    throw Error(ErrorKind::input, fmt::format("'{}' has {}, but '{}' has {}; compare runs on the "
                                              "same images.",
                                              a.run.name, of_a, b.run.name, of_b));
  };
  const auto frames = [](const ListedRun& run) {
    return fmt::format("{} frames", run.frames.times_s.size());
  };
  const auto every = [](const ListedRun& run) {
    return run.frames.every == 1 ? std::string("all frames")
                                 : fmt::format("one frame in {}", run.frames.every);
  };
  if (a.frames.times_s.size() != b.frames.times_s.size()) refuse(frames(a), frames(b));
  if (a.run.run && b.run.run && a.frames.every != b.frames.every) refuse(every(a), every(b));
}

/// What all runs are about, by the first that knows it, a run of loopbit before others. A list that
/// has no frames of its own gets those.
FramesRead share_frames(std::vector<ListedRun>& runs) {
  const ListedRun* known = nullptr;
  for (const ListedRun& run : runs) {
    if (!run.frames.times_s.empty() && (!known || (run.run.run && !known->run.run))) known = &run;
  }
  if (!known) return {};
  for (const ListedRun& run : runs) {
    if (!run.frames.times_s.empty()) check_same_frames(*known, run);
    for (const ReportedMatch& match : run.run.list.matches) {
      if (static_cast<std::size_t>(match.query) < known->frames.times_s.size()) continue;
      throw Error(
          ErrorKind::input,
          fmt::format("'{}' has a match for frame {}, but '{}' has {} frames; compare runs on the "
                      "same images.",
                      run.run.name, match.query, known->run.name, known->frames.times_s.size()));
    }
  }
  FramesRead frames = known->frames;
  for (ListedRun& run : runs) run.run.list.times_s = frames.times_s;
  return frames;
}

/// The truth of the first run that has one is that of all: they are about the same images.
std::vector<ReportRun> read_runs(const CompareFlags& flags) {
  std::vector<ListedRun> listed;
  listed.reserve(flags.runs.size());
  for (const std::string& text : flags.runs) listed.push_back(listed_run(text));
  const FramesRead frames = share_frames(listed);
  std::vector<ReportRun> runs;
  runs.reserve(listed.size());
  for (ListedRun& run : listed) runs.push_back(std::move(run.run));
  take_truth(runs.front(), flags.truth, frames);
  const auto judged = std::find_if(runs.begin(), runs.end(),
                                   [](const ReportRun& run) { return run.truth.has_value(); });
  if (judged == runs.end()) {
    throw Error(ErrorKind::option, "None of the runs has ground truth; add --truth FILE.");
  }
  for (ReportRun& run : runs) {
    run.truth = judged->truth;
    run.evaluation = judged->evaluation;
    if (run.positions_m.empty()) run.positions_m = judged->positions_m;
  }
  return runs;
}

ComparedRun row_of(const ReportRun& run) {
  ComparedRun row{run.name, evaluate(run.list, *run.truth, run.evaluation), std::nullopt};
  if (run.run) row.time = summarize(run.run->detections, total_ms);
  return row;
}

void print_table(const std::vector<ComparedRun>& rows) {
  std::size_t width = 4;
  for (const ComparedRun& row : rows) width = std::max(width, printable(row.name).size());
  fmt::print(
      "{:<{}}  revisits  recall  precision  wrong  R@100%P  avg.prec.  pair recall   mean ms    "
      "p99 ms\n",
      "run", width);
  for (const ComparedRun& row : rows) {
    const Evaluation& e = row.evaluation;
    const auto of_revisits = [&](double share) {
      return share_text(share, e.decision.positives, 4);
    };
    fmt::print("{:<{}}  {:8}  {:>6}     {:>6}  {:5}   {:>6}     {:>6}       {:>6}",
               printable(row.name), width, e.decision.positives, of_revisits(e.decision.recall()),
               share_text(e.decision.precision(), e.decision.right + e.decision.wrong, 4),
               e.decision.wrong, of_revisits(e.recall_at_full_precision),
               of_revisits(e.average_precision),
               share_text(e.pairs.recall(), e.pairs.positives, 4));
    if (row.time) fmt::print("  {:8.2f}  {:8.2f}", row.time->mean, row.time->p99);
    fmt::print("\n");
  }
}

void print_json(const std::vector<ComparedRun>& rows) {
  auto json = nlohmann::ordered_json::array();
  for (const ComparedRun& row : rows) {
    auto entry = nlohmann::ordered_json::parse(to_json(row.evaluation, false));
    entry["name"] = row.name;
    if (row.time) entry["time_ms"] = {{"mean", row.time->mean}, {"p99", row.time->p99}};
    json.push_back(entry);
  }
  print_document(json);
}

void write_plot(const std::string& file, const std::vector<ComparedRun>& rows) {
  std::vector<NamedEvaluation> runs;
  runs.reserve(rows.size());
  for (const ComparedRun& row : rows) runs.push_back({row.name, row.evaluation});
  write_file(file, curve_plot(runs));
}

void compare_command(const CompareFlags& flags) {
  const std::vector<ReportRun> runs = read_runs(flags);
  std::vector<ComparedRun> rows;
  rows.reserve(runs.size());
  for (const ReportRun& run : runs) rows.push_back(row_of(run));
  if (!flags.out.empty()) write_report(flags.out, runs, flags.report);
  if (!flags.plot.empty()) write_plot(flags.plot, rows);
  if (flags.json) {
    print_json(rows);
  } else {
    print_table(rows);
    if (!flags.out.empty()) fmt::print("report     {}\n", printable(flags.out));
    if (!flags.plot.empty()) fmt::print("plot       {}\n", printable(flags.plot));
  }
  if (flags.open) open_page(flags.out);
}

}  // namespace

void add_compare(CLI::App& app) {
  auto flags = std::make_shared<CompareFlags>();
  CLI::App* command = app.add_subcommand("compare", "Compare runs or detectors on the same images");
  command
      ->add_option("RUN", flags->runs,
                   "Two or more run folders or CSV files of query,match[,score], each as PATH or "
                   "NAME=PATH")
      ->required()
      ->expected(2, 64);
  CLI::Option* out = command->add_option("--out", flags->out, "Write one page that shows all runs")
                         ->type_name("FILE");
  command->add_flag("--open", flags->open, "Open the page in the browser")->needs(out);
  add_plot_flag(*command, flags->plot);
  command->add_flag("--json", flags->json, "Print the table as JSON");
  add_report_flag(*command, flags->report);
  flags->truth.add_to(*command);
  flags->truth.add_poses_to(*command);
  command->footer(list_truth_settings());
  command->callback([command, flags] {
    protect_inputs(*command, {"--out", "--plot"});
    compare_command(*flags);
  });
}

}  // namespace loopbit::cli
