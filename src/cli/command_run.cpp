// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <memory>
#include <utility>

#include "commands.hpp"
#include "session.hpp"

namespace loopbit::cli {
namespace {

struct RunFlags {
  SessionFlags session;
  std::string input;
  int every = 1;
  int limit = 0;
  std::string truth;
  std::string not_false;
  std::string ignore;
};

std::optional<GroundTruth> read_truth(const RunFlags& flags) {
  if (flags.truth.empty()) return std::nullopt;
  GroundTruth truth;
  truth.same_place = read_place_runs(flags.truth);
  if (!flags.not_false.empty()) truth.near_place = read_place_runs(flags.not_false);
  if (!flags.ignore.empty()) truth.ignored = read_frame_list(flags.ignore);
  return truth;
}

int run_command(const RunFlags& flags) {
  Session session;
  session.truth = read_truth(flags);
  session.source = subsample(open_source(flags.input), static_cast<std::size_t>(flags.every),
                             static_cast<std::size_t>(flags.limit));
  session.input = flags.input;
  session.every = flags.every;
  session.limit = flags.limit;
  return run_session(std::move(session), flags.session);
}

}  // namespace

void add_run(CLI::App& app, int& exit_code) {
  auto flags = std::make_shared<RunFlags>();
  CLI::App* command = app.add_subcommand("run", "Find the loops in a sequence of images");
  command
      ->add_option("INPUT", flags->input,
                   "A folder of images (natural order), a KITTI odometry, EuRoC or TUM RGB-D "
                   "folder, a text file listing images, a video, or camera:N")
      ->required();
  command->add_option("--out", flags->session.out, "Folder for loops.csv and run.json")
      ->type_name("DIR")
      ->required();
  flags->session.add_to(*command);
  command->add_option("--every", flags->every, "Read every N-th frame only")
      ->type_name("N")
      ->check(CLI::Range(1, 1'000'000));
  command->add_option("--limit", flags->limit, "Read at most N frames; 0 = all")
      ->type_name("N")
      ->check(CLI::Range(0, 2'000'000'000));
  CLI::Option* truth =
      command
          ->add_option("--truth", flags->truth, "True places, CSV query,first,last: scores the run")
          ->type_name("FILE");
  command
      ->add_option("--not-false", flags->not_false,
                   "Matches that are not wrong, nor right by this alone, CSV query,first,last")
      ->type_name("FILE")
      ->needs(truth);
  command->add_option("--ignore", flags->ignore, "Queries that are not scored, one a line")
      ->type_name("FILE")
      ->needs(truth);
  command->callback([flags, &exit_code] { exit_code = run_command(*flags); });
}

}  // namespace loopbit::cli
