// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "commands.hpp"
#include "session.hpp"

namespace loopbit::cli {
namespace {

namespace fs = std::filesystem;

struct RunFlags {
  SessionFlags session;
  std::string input;
  int every = 1;
  int limit = 0;
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
  for (int number = 2; !flags.session.overwrite && fs::exists(folder, error); ++number) {
    folder = fmt::format("{}_loops_{}", name, number);
  }
  return folder;
}

int run_command(const RunFlags& flags, const Arguments& arguments) {
  Session session;
  SessionFlags output = flags.session;
  if (output.out.empty() && output.map.empty()) output.out = usual_folder(flags);
  session.source =
      subsample(open_source(flags.input, flags.max_megapixels),
                static_cast<std::size_t>(flags.every), static_cast<std::size_t>(flags.limit));
  const std::optional<std::size_t> frames = exact_size(*session.source, flags.input);
  const bool is_whole = frames && flags.limit == 0;
  flags.truth.check(flags.every, frames, is_whole);
  session.scoring = [&, frames, is_whole](const FrameTimes& times_s) {
    const bool all = is_whole && times_s.size() == *frames;
    return flags.truth.scoring.resolve({.every = flags.every, .times_s = times_s, .all = all});
  };
  session.positions = [&](const FrameTimes& times_s) {
    return flags.truth.read_positions({.every = flags.every, .times_s = times_s});
  };
  session.input = flags.input;
  session.arguments = arguments;
  session.truth_files = flags.truth.files();
  session.truth_description = flags.truth.scoring.description();
  session.every = flags.every;
  session.limit = flags.limit;
  return run_session(std::move(session), output);
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
          "--out", flags->session.out,
          "Folder for loops.csv, run.json and report.html; default: INPUT_loops, with a new number "
          "if that exists; with --map: MAP_session_N")
      ->type_name("DIR");
  flags->session.add_to(*command);
  command->add_option("--every", flags->every, "Read only every N-th frame")
      ->type_name("N")
      ->check(whole_number(1, 1'000'000));
  command->add_option("--limit", flags->limit, "Read at most N frames; 0 = all")
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
