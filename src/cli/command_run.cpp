// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <system_error>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "loopbit/camera_file.hpp"
#include "loopbit/error.hpp"
#include "loopbit/recordings.hpp"

#include "commands.hpp"
#include "process.hpp"
#include "session.hpp"
#include "truth_flags.hpp"

namespace loopbit::cli {
namespace {

namespace fs = std::filesystem;

struct RunFlags {
  SessionFlags session;
  std::string input;
  std::string topic;
  std::string odometry_topic;
  Sampling sampling;
  int max_megapixels = kMaxMegapixels;
  TruthFlags truth;
  std::string camera;
  bool no_poses = false;
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

/// The calibration in the data set's folder or in the recording, and where it is from. Throws
/// Error.
std::pair<std::optional<CameraModel>, std::string> found_camera(const RunFlags& flags) {
  if (is_recording(flags.input)) {
    const std::string yaml = recorded_camera_info(flags.input, flags.topic);
    if (yaml.empty()) return {};
    return {parse_camera_info(yaml, "camera_info of " + flags.input), flags.input};
  }
  const auto found = find_camera(flags.input);
  if (!found) return {};
  return {read_camera(found->path, found->index), found->path};
}

/// The calibration of --camera, or the one in the data set's folder or the recording. Throws Error
/// only for the former.
void choose_camera(const RunFlags& flags, SessionFlags& session) {
  if (flags.no_poses) return;
  RunRequest& run = session.run;
  if (!flags.camera.empty()) {
    run.camera = read_camera(flags.camera);
    run.camera_file = flags.camera;
    return;
  }
  try {
    std::tie(run.camera, run.camera_file) = found_camera(flags);
  } catch (const Error& error) {
    tell(fmt::format("loopbit: No relative poses: {}\n", error.what()));
  }
  session.found_camera = run.camera.has_value();
}

int run_command(RunFlags& flags, const Arguments& arguments) {
  RunRequest& run = flags.session.run;
  if (run.correct && run.odometry.empty() && flags.odometry_topic.empty()) {
    throw Error(
        ErrorKind::option,
        "--correct needs odometry: give it by --odometry FILE, or --odometry-topic NAME of a "
        "recording.");
  }
  if (run.folder.empty() && run.map.empty()) run.folder = usual_folder(flags);
  run.arguments = arguments;
  run.scoring = flags.truth.scoring;
  run.poses = flags.truth.poses;
  auto source = open_input(flags.input, flags.topic, flags.max_megapixels, flags.odometry_topic);
  choose_camera(flags, flags.session);
  return run_session(subsample(std::move(source), flags.sampling), flags.input, flags.sampling,
                     flags.session);
}

/// Adds the flags for odometry.
void add_odometry_flags(CLI::App& command, RunFlags& flags) {
  CLI::Option* odometry =
      command
          .add_option(
              "--odometry", flags.session.run.odometry,
              "Poses of the camera by odometry (TUM, KITTI, EuRoC, or TUM with covariances), "
              "matched by time or row; with a camera, relative poses are in metres. --set "
              "odometry.NAME=VALUE says how fast it drifts")
          ->type_name("FILE");
  command
      .add_option("--odometry-topic", flags.odometry_topic,
                  "The same from a topic of a recording: odometry, poses, or /tf. /tf_static says "
                  "where the camera is on the robot")
      ->type_name("NAME")
      ->excludes(odometry);
  command.add_flag(
      "--correct", flags.session.run.correct,
      "After the run, correct the trajectory by a pose graph of odometry and loops, and "
      "withdraw the loops that it rejects: writes corrected.tum, graph.g2o, "
      "judged_loops.csv and trajectory.csv");
}

/// Adds the flags for camera, depth and stereo.
void add_camera_flags(CLI::App& command, RunFlags& flags) {
  CLI::Option* camera =
      command
          .add_option(
              "--camera", flags.camera,
              "Calibration of the images (EuRoC, Kalibr, ROS, OpenCV, KITTI): "
              "relative_poses.csv gets the relative pose of each loop, and a fisheye finds more "
              "loops. Default: the one in a KITTI or EuRoC folder, camera.yaml in the folder, or "
              "camera_info in a recording")
          ->type_name("FILE");
  CLI::Option* depth =
      command
          .add_option("--depth", flags.session.run.depth,
                      "Depth images, so that relative poses are in metres: a folder with names "
                      "like those of the images, or a TUM RGB-D folder with its depth.txt")
          ->type_name("DIR");
  command
      .add_option("--depth-scale", flags.session.run.depth_scale,
                  "Units per metre of 16-bit depth images; most sensors: 1000")
      ->type_name("N")
      ->capture_default_str()
      ->check(number(1e-3, 1e6))
      ->needs(depth);
  CLI::Option* right =
      command
          .add_option("--right", flags.session.run.right,
                      "Images of the right camera of a stereo pair, so that relative poses are in "
                      "metres: a folder with names like those of the images. Its calibration: in "
                      "its KITTI or EuRoC folder, or the second one of --camera")
          ->type_name("DIR")
          ->excludes(depth);
  command
      .add_option("--baseline", flags.session.run.baseline_m,
                  "Baseline of a rectified stereo pair in metres, in place of a calibration")
      ->type_name("M")
      ->check(number(1e-4, 1e4))
      ->needs(right);
  command
      .add_flag("--no-poses", flags.no_poses, "Use no calibration and measure no relative poses")
      ->excludes(camera)
      ->excludes(depth)
      ->excludes(right);
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
  add_mask_flag(*command, flags->session.run.mask);
  flags->truth.add_to(*command);
  flags->truth.add_poses_to(*command);
  add_camera_flags(*command, *flags);
  add_odometry_flags(*command, *flags);
  command->footer(list_truth_settings());
  command->callback([command, flags, &arguments, &exit_code] {
    protect_inputs(*command, {"--mcap-out"});
    exit_code = run_command(*flags, arguments);
  });
}

}  // namespace loopbit::cli
