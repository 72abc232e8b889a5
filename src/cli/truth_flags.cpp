// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "truth_flags.hpp"

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/poses.hpp"
#include "loopbit/protocol.hpp"

#include "commands.hpp"

namespace loopbit::cli {
namespace {

void set_pose_rule(std::optional<PoseTruthOptions>& poses, const std::string& setting) {
  const auto [name, value] = split_setting(setting);
  if (!poses) poses.emplace();
  if (set_field(*poses, "truth", name, value)) return;
  throw Error(
      ErrorKind::option,
      fmt::format("There is no setting '{}' of truth by poses; --help lists the settings.", name));
}

}  // namespace

void TruthFlags::add_to(CLI::App& command) {
  const ScoringNames& names = scoring.names = {.truth = "--truth",
                                               .not_false = "--not-false",
                                               .ignore = "--ignore",
                                               .protocol = "--protocol",
                                               .tolerance_frames = "--tolerance",
                                               .poses = "--truth-set",
                                               .views = "--truth-views",
                                               .variable = "--truth-variable"};
  CLI::Option* truth =
      command
          .add_option(names.truth, scoring.truth,
                      "Ground truth: CSV of query,first,last or query,match; KITTI poses, a TUM "
                      "trajectory or EuRoC states; a loop matrix as .mat, text or image")
          ->type_name("FILE");
  command
      .add_option(names.not_false, scoring.not_false,
                  "Matches that are not wrong, but right only if truth lists them; CSV as above")
      ->type_name("FILE")
      ->needs(truth);
  command.add_option(names.ignore, scoring.ignore, "Queries that are not scored, one per line")
      ->type_name("FILE")
      ->needs(truth);
  add_rules_to(command, truth);
}

void TruthFlags::add_rules_to(CLI::App& command, CLI::Option* truth) {
  const ScoringNames& names = scoring.names;
  command
      .add_option(names.protocol, scoring.protocol, "A published scoring protocol, listed below")
      ->type_name("NAME")
      ->needs(truth);
  command
      .add_option(names.tolerance_frames, scoring.tolerance_frames,
                  "A match this many frames before or after a true place is also right")
      ->type_name("N")
      ->check(whole_number(0, 1'000'000))
      ->needs(truth);
  command
      .add_option_function<std::vector<std::string>>(
          names.poses,
          [this](const std::vector<std::string>& settings) {
            for (const std::string& setting : settings) set_pose_rule(scoring.poses, setting);
          },
          "One setting of truth by poses; may be repeated")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false)
      ->needs(truth);
  command
      .add_option(names.views, scoring.views, "Rows per frame in a loop matrix (2: left, right)")
      ->type_name("N")
      ->check(whole_number(1, 64))
      ->needs(truth);
  command.add_option(names.variable, scoring.variable, "The variable to read from a .mat file")
      ->type_name("NAME")
      ->needs(truth);
}

void TruthFlags::add_poses_to(CLI::App& command) {
  command
      .add_option("--poses", poses,
                  "KITTI poses, a TUM trajectory or EuRoC states, for the trajectory in the report")
      ->type_name("FILE");
}

Positions TruthFlags::read_positions(const FramesRead& frames) const {
  const std::string file = scoring.poses_file(poses);
  if (file.empty()) return {};
  return loopbit::read_positions(file, frames);
}

std::string list_truth_settings() {
  std::string list = list_settings<PoseTruthOptions>("Truth by poses (--truth-set NAME=VALUE)");
  list += "Protocols (--protocol NAME); numbers of different protocols must not be mixed:\n";
  for (const Protocol& protocol : protocols()) {
    list += fmt::format("  {}: {}\n", protocol.name, protocol.help);
  }
  return list;
}

}  // namespace loopbit::cli
