// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <memory>
#include <string>

#include <fmt/format.h>

#include "loopbit/evaluation.hpp"
#include "loopbit/printable.hpp"
#include "loopbit/protocol.hpp"
#include "loopbit/write_file.hpp"

#include "commands.hpp"
#include "curve_plot.hpp"
#include "run_list.hpp"
#include "summary.hpp"

namespace loopbit::cli {
namespace {

constexpr std::size_t kMaxListed = 20;

struct EvalFlags {
  std::string detections;
  TruthFlags truth;
  std::string plot;
  bool json = false;
};

void print_decision(const DecisionCounts& counts) {
  const int judged = counts.right + counts.wrong;
  fmt::print("decided    {} of {} revisits found: recall {}\n", counts.right, counts.positives,
             share_text(counts.recall(), counts.positives, 4));
  fmt::print("           {}: precision {}", counted(counts.wrong, "wrong loop"),
             share_text(counts.precision(), judged, 4));
  if (judged > 0) {
    const Interval interval = counts.precision_interval();
    fmt::print(" (95 % interval {:.4f} to {:.4f})", interval.low, interval.high);
  }
  fmt::print("\n");
  if (counts.tolerated + counts.ignored > 0) {
    fmt::print("           {} tolerated, {} ignored\n", counted(counts.tolerated, "loop"),
               counted(counts.ignored, "frame"));
  }
}

void print_late(const Evaluation& evaluation) {
  const DecisionCounts& late = evaluation.late;
  const DecisionCounts& decision = evaluation.decision;
  if (late.right == decision.right && late.wrong == decision.wrong) return;
  fmt::print("late       with late and without withdrawn loops: recall {}; {} wrong\n",
             share_text(late.recall(), late.positives, 4), late.wrong);
}

void print_pairs(const PairCounts& pairs) {
  fmt::print("pairs      {} of {} true pairs found: recall {}; {} wrong: precision {}\n",
             pairs.found, pairs.positives, share_text(pairs.recall(), pairs.positives, 4),
             pairs.wrong, share_text(pairs.precision(), pairs.right + pairs.wrong, 4));
}

void print_sweep(const Evaluation& evaluation) {
  if (evaluation.decision.positives == 0) {
    fmt::print("swept      nothing: there is no revisit to find\n");
    return;
  }
  if (evaluation.score_at_full_precision) {
    fmt::print("swept      recall {:.4f} at 100 % precision (score {} or more)\n",
               evaluation.recall_at_full_precision, *evaluation.score_at_full_precision);
  } else {
    fmt::print("swept      recall 0 at 100 % precision: {}\n",
               evaluation.curve.empty() ? "there are no matches" : "the highest score is wrong");
  }
  fmt::print("           average precision {:.4f}\n", evaluation.average_precision);
}

/// Its name, and what it is, unless a run was scored by one that is not known here.
std::string described(const std::string& protocol) {
  for (const Protocol& known : protocols()) {
    if (known.name == protocol) return fmt::format("{}: {}", known.name, known.help);
  }
  return printable(protocol);
}

void print_wrong(const std::vector<ReportedMatch>& wrong) {
  if (wrong.empty()) return;
  fmt::print("wrong      query  match  score\n");
  for (std::size_t i = 0; i < std::min(wrong.size(), kMaxListed); ++i) {
    fmt::print("           {:>5}  {:>5}  {:g}\n", wrong[i].query, wrong[i].match, wrong[i].score);
  }
  if (wrong.size() > kMaxListed) {
    fmt::print("           and {} more: --json lists all\n", wrong.size() - kMaxListed);
  }
}

void eval_command(const EvalFlags& flags) {
  const ReportRun run = scored_run(flags.detections, flags.truth);
  const Evaluation evaluation = evaluate(run.list, *run.truth, run.evaluation);
  if (!flags.plot.empty()) write_file(flags.plot, curve_plot({{run.name, evaluation}}));
  if (flags.json) {
    fmt::print("{}\n", to_json(evaluation, true));
    return;
  }
  if (const std::string& protocol = run.evaluation.protocol; !protocol.empty()) {
    fmt::print("protocol   {}\n", described(protocol));
  }
  if (run.evaluation.tolerance_frames > 0) {
    fmt::print("tolerance  {}\n", counted(run.evaluation.tolerance_frames, "frame"));
  }
  print_decision(evaluation.decision);
  print_late(evaluation);
  print_sweep(evaluation);
  print_pairs(evaluation.pairs);
  print_wrong(evaluation.wrong_loops);
  if (!flags.plot.empty()) fmt::print("plot       {}\n", printable(flags.plot));
}

}  // namespace

void add_eval(CLI::App& app) {
  auto flags = std::make_shared<EvalFlags>();
  CLI::App* command =
      app.add_subcommand("eval", "Score the matches of any detector against ground truth");
  command
      ->add_option(
          "DETECTIONS", flags->detections,
          "A run folder, or a CSV file of query,match[,score] with or without a header row")
      ->required();
  flags->truth.add_to(*command);
  add_plot_flag(*command, flags->plot);
  command->add_flag("--json", flags->json, "Print all numbers, wrong loops and the curve as JSON");
  command->footer(list_truth_settings());
  command->callback([command, flags] {
    protect_inputs(*command, {"--plot"});
    eval_command(*flags);
  });
}

}  // namespace loopbit::cli
