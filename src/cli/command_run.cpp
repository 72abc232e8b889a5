// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <memory>
#include <utility>

#include "loopbit/error.hpp"

#include "commands.hpp"
#include "session.hpp"
#include "truth_flags.hpp"

namespace loopbit::cli {
namespace {

struct RunFlags {
  SessionFlags session;
  std::string input;
  Sampling sampling;
  int max_megapixels = kMaxMegapixels;
  TruthFlags truth;
};

int run_command(RunFlags& flags, const Arguments& arguments) {
  RunRequest& run = flags.session.run;
  if (run.folder.empty() && run.map.empty()) {
    throw Error(ErrorKind::option, "The run has no output; add --out DIR, --map MAP.db, or both.");
  }
  run.arguments = arguments;
  run.scoring = flags.truth.scoring;
  run.poses = flags.truth.poses;
  return run_session(subsample(open_source(flags.input, flags.max_megapixels), flags.sampling),
                     flags.input, flags.sampling, flags.session);
}

}  // namespace

void add_run(CLI::App& app, const Arguments& arguments, int& exit_code) {
  auto flags = std::make_shared<RunFlags>();
  CLI::App* command = app.add_subcommand("run", "Find the loops in a sequence of images");
  command
      ->add_option("INPUT", flags->input,
                   "A folder of images (natural order), a KITTI odometry, EuRoC or TUM RGB-D "
                   "folder, a text file listing images, a video, or camera:N")
      ->required();
  command
      ->add_option(
          "--out", flags->session.run.folder,
          "Folder for loops.csv, run.json and report.html; default with --map: MAP_session_N")
      ->type_name("DIR");
  flags->session.add_to(*command);
  command->add_option("--every", flags->sampling.every, "Read only every N-th frame")
      ->type_name("N")
      ->check(whole_number(1, 1'000'000));
  command->add_option("--limit", flags->sampling.limit, "Read at most N frames; 0 = all")
      ->type_name("N")
      ->check(whole_number(0, 2'000'000'000));
  add_image_flag(*command, flags->max_megapixels);
  flags->truth.add_to(*command);
  flags->truth.add_poses_to(*command);
  command->footer(list_truth_settings());
  command->callback(
      [flags, &arguments, &exit_code] { exit_code = run_command(*flags, arguments); });
}

}  // namespace loopbit::cli
