// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <memory>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/world.hpp"

#include "commands.hpp"
#include "progress.hpp"
#include "session.hpp"
#include "truth_flags.hpp"

namespace loopbit::cli {
namespace {

struct DemoFlags {
  SessionFlags session;
  std::vector<std::string> world_settings;
  std::string images;
  WorldOptions world;
  TruthFlags truth;
  std::vector<CLI::Option*> of_detector;
};

std::string describe(const World& world) {
  const WorldOptions& options = world.options();
  return fmt::format("built-in world, seed {}, {:.2f} laps of {:.0f} m", options.seed, options.laps,
                     world.circuit_m());
}

Positions positions(const World& world, std::size_t frames) {
  Positions positions;
  positions.reserve(frames);
  for (int frame = 0; static_cast<std::size_t>(frame) < frames; ++frame) {
    const LevelPose pose = world.pose(frame);
    positions.emplace_back(cv::Vec3d(pose.x_m, pose.y_m, pose.z_m));
  }
  return positions;
}

/// Throws Error (kind option) if one is given that says how to detect.
void check_nothing_is_detected(const DemoFlags& flags) {
  for (const CLI::Option* option : flags.of_detector) {
    if (option->count() == 0) continue;
    throw Error(
        ErrorKind::option,
        fmt::format("{} cannot be used with --write-images, which detects nothing; leave out "
                    "one of them.",
                    option->get_name()));
  }
}

void write_images(const World& world, const std::string& folder, bool quiet) {
  {
    Progress progress(static_cast<std::size_t>(world.options().frames),
                      {.shown = !quiet, .of_detection = false});
    write_dataset(world, folder, [&](int) { progress.advance(false); });
  }
  if (quiet) return;
  fmt::print(
      "written    {0}/images ({1} frames of the {2}), {0}/truth.csv, {0}/not_false.csv, "
      "{0}/poses.txt, {0}/odometry.txt, {0}/times.txt, {0}/camera.yaml\n",
      folder, world.options().frames, describe(world));
}

int demo_command(DemoFlags& flags, const Arguments& arguments) {
  WorldOptions options = flags.world;
  for (const std::string& setting : flags.world_settings) {
    const auto [name, value] = split_setting(setting);
    if (!set_field(options, "world", name, value)) {
      throw Error(ErrorKind::option, fmt::format("There is no world setting '{}'; see 'loopbit "
                                                 "demo --help'.",
                                                 name));
    }
  }
  const auto frames = static_cast<std::size_t>(std::max(0, options.frames));
  flags.truth.scoring.check({.times_s = FrameTimes(frames), .all = true});
  const auto world = std::make_shared<const World>(options);
  if (!flags.images.empty()) {
    check_nothing_is_detected(flags);
    write_images(*world, flags.images, flags.session.quiet);
    return success;
  }
  RunRequest& run = flags.session.run;
  run.arguments = arguments;
  run.scoring = flags.truth.scoring;
  run.truth = {.same_place = world->same_place(), .near_place = world->near_place()};
  run.truth_description = "exact (built-in world)";
  run.positions_m = positions(*world, frames);
  if (!run.correct) return run_session(make_world_source(world), "demo", {}, flags.session);
  run.camera = mean_camera(*world);
  run.camera_file = "the camera of the built-in world";
  return run_session(make_world_source(world, drifting_odometry(*world)), "demo", {},
                     flags.session);
}

}  // namespace

void add_demo(CLI::App& app, const Arguments& arguments, int& exit_code) {
  auto flags = std::make_shared<DemoFlags>();
  CLI::App* command =
      app.add_subcommand("demo", "Run the built-in world, whose true loops are known");
  command->footer(list_settings<WorldOptions>("World settings (--world NAME=VALUE)") +
                  list_truth_settings());
  flags->session.run.folder = "loopbit_demo";
  CLI::Option* out = command
                         ->add_option("--out", flags->session.run.folder,
                                      "Folder for loops.csv, run.json and report.html")
                         ->type_name("DIR")
                         ->capture_default_str();
  flags->session.add_to(*command);
  command->add_flag("--correct", flags->session.run.correct,
                    "Give the drive odometry that drifts and a camera, correct its trajectory by a "
                    "pose graph of odometry and loops, and withdraw the loops that it rejects");
  flags->of_detector = command->get_options(
      [&](CLI::Option* option) { return option != out && !option->check_name("--quiet"); });
  command->add_option("--frames", flags->world.frames, "Frames in the whole drive")
      ->type_name("N")
      ->capture_default_str()
      ->check(whole_number(1, 10'000'000));
  command->add_option("--seed", flags->world.seed, "Random seed of the town")
      ->type_name("S")
      ->capture_default_str()
      ->check(whole_number(0, 2'147'483'647));
  command->add_option("--world", flags->world_settings, "One setting of the world; may be repeated")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command
      ->add_option("--write-images", flags->images,
                   "Write the drive as a data set with ground truth, without detecting loops")
      ->type_name("DIR")
      ->excludes(out);
  flags->truth.add_to(*command);
  command->callback([command, flags, &arguments, &exit_code] {
    protect_inputs(*command, {"--mcap-out"});
    exit_code = demo_command(*flags, arguments);
  });
}

}  // namespace loopbit::cli
