// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "loopbit/recordings.hpp"

#include "commands.hpp"
#include "session.hpp"
#include "truth_flags.hpp"

namespace loopbit::cli {
namespace {

namespace fs = std::filesystem;

struct RunFlags {
  SessionFlags session;
  std::string input;
  std::string topic;
  Sampling sampling;
  int max_megapixels = kMaxMegapixels;
  TruthFlags truth;
};

/// "images_loops" in the working folder for a folder "images" anywhere; with a new number if that
/// exists and must stay.
std::string usual_folder(const RunFlags& flags) {
  const fs::path input = fs::absolute(flags.input).lexically_normal();
  const fs::path last = input.has_filename() ? input : input.parent_path();
  std::error_code error;
  std::string name = (fs::is_directory(last, error) ? last.filename() : last.stem()).string();
  std::replace(name.begin(), name.end(), ':', '_');  // of camera:0
  std::string folder = name + "_loops";
  for (int number = 2; !flags.session.run.overwrite && fs::exists(folder, error); ++number) {
    folder = fmt::format("{}_loops_{}", name, number);
  }
  return folder;
}

int run_command(RunFlags& flags, const Arguments& arguments) {
  RunRequest& run = flags.session.run;
  if (run.folder.empty() && run.map.empty()) run.folder = usual_folder(flags);
  run.arguments = arguments;
  run.scoring = flags.truth.scoring;
  run.poses = flags.truth.poses;
  return run_session(
      subsample(open_input(flags.input, flags.topic, flags.max_megapixels), flags.sampling),
      flags.input, flags.sampling, flags.session);
}

}  // namespace

void add_run(CLI::App& app, const Arguments& arguments, int& exit_code) {
  auto flags = std::make_shared<RunFlags>();
  CLI::App* command = app.add_subcommand("run", "Find the loops in a sequence of images");
  command
      ->add_option(
          "INPUT", flags->input,
          "A folder of images (natural order), a KITTI odometry, EuRoC or TUM RGB-D "
          "folder, a text file listing images, a video, a ROS bag or MCAP file, or camera:N")
      ->required();
  command
      ->add_option(
          "--out", flags->session.run.folder,
          "Folder for loops.csv, run.json and report.html; default: INPUT_loops, with a new number "
          "if that exists; with --map: MAP_session_N")
      ->type_name("DIR");
  flags->session.add_to(*command);
  command->add_option("--every", flags->sampling.every, "Read only every N-th frame")
      ->type_name("N")
      ->check(whole_number(1, 1'000'000));
  command->add_option("--limit", flags->sampling.limit, "Read at most N frames; 0 = all")
      ->type_name("N")
      ->check(whole_number(0, 2'000'000'000));
  add_image_flag(*command, flags->max_megapixels);
  add_topic_flag(*command, flags->topic);
  flags->truth.add_to(*command);
  flags->truth.add_poses_to(*command);
  command->footer(list_truth_settings());
  command->callback(
      [flags, &arguments, &exit_code] { exit_code = run_command(*flags, arguments); });
}

}  // namespace loopbit::cli
