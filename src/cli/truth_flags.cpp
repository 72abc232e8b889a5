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

const char* name_of(TruthKind kind) {
  switch (kind) {
    case TruthKind::runs:
      return "a list of true places";
    case TruthKind::matrix:
      return "a loop matrix";
    case TruthKind::poses:
      return "poses";
  }
  return "";
}

}  // namespace

void TruthFlags::add_to(CLI::App& command) {
  CLI::Option* option_truth =
      command
          .add_option("--truth", truth,
                      "Ground truth: CSV of query,first,last or query,match; KITTI poses, a TUM "
                      "trajectory or EuRoC states; a loop matrix as .mat, text or image")
          ->type_name("FILE");
  command
      .add_option("--not-false", not_false,
                  "Matches that are not wrong, but right only if truth lists them; CSV as above")
      ->type_name("FILE")
      ->needs(option_truth);
  command.add_option("--ignore", ignore, "Queries that are not scored, one per line")
      ->type_name("FILE")
      ->needs(option_truth);
  command.add_option("--protocol", protocol, "A published scoring protocol, listed below")
      ->type_name("NAME")
      ->needs(option_truth);
  fixed_by_protocol_[0] =
      command
          .add_option("--tolerance", tolerance_frames,
                      "A match this many frames before or after a true place is also right")
          ->type_name("N")
          ->check(whole_number(0, 1'000'000));
  fixed_by_protocol_[1] =
      command.add_option("--truth-set", settings, "One setting of truth by poses; may be repeated")
          ->type_name("NAME=VALUE")
          ->allow_extra_args(false);
  fixed_by_protocol_[2] =
      command
          .add_option("--truth-views", views, "Rows per frame in a loop matrix (2: left, right)")
          ->type_name("N")
          ->check(whole_number(1, 64));
  for (CLI::Option* option :
       {fixed_by_protocol_[0], fixed_by_protocol_[1], fixed_by_protocol_[2]}) {
    option->needs(option_truth);
  }
  command.add_option("--truth-variable", variable, "The variable to read from a .mat file")
      ->type_name("NAME")
      ->needs(option_truth);
}

void TruthFlags::add_poses_to(CLI::App& command) {
  command
      .add_option("--poses", poses,
                  "KITTI poses, a TUM trajectory or EuRoC states, for the trajectory in the report")
      ->type_name("FILE");
}

EvaluationOptions TruthFlags::evaluation() const {
  if (protocol.empty()) return {.tolerance_frames = tolerance_frames, .protocol = {}};
  const Protocol& named = find_protocol(protocol);
  for (const CLI::Option* option : fixed_by_protocol_) {
    if (option && option->count() > 0) {
      throw Error(ErrorKind::option,
                  fmt::format("{} cannot be given with --protocol {}, which fixes it; leave out "
                              "one of them.",
                              option->get_name(), protocol));
    }
  }
  return named.evaluation();
}

TruthOptions TruthFlags::truth_options(int every) const {
  TruthOptions options;
  options.views = views;
  for (const std::string& setting : settings) {
    const auto [name, value] = split_setting(setting);
    if (!set_field(options.poses, "truth", name, value)) {
      throw Error(ErrorKind::option,
                  fmt::format("There is no setting '{}' of truth by poses; --help lists the "
                              "settings.",
                              name));
    }
  }
  if (!protocol.empty()) options = find_protocol(protocol).truth;
  options.variable = variable;
  options.every = every;
  return options;
}

void TruthFlags::check(int every, std::optional<std::size_t> frames, bool all_read) const {
  (void)evaluation();
  (void)truth_options(every);
  if (!poses.empty()) check_poses(poses, frames, every);
  if (!given()) return;
  const TruthKind kind = truth_kind(truth);
  check_kind(kind);
  GroundTruth others;
  add_others(others);
  if (kind == TruthKind::poses) {  // what they say needs the times of the frames
    check_poses(truth, frames, every, all_read);
  } else {
    (void)read_truth(FrameTimes(frames.value_or(0)), every, all_read);
  }
}

std::string TruthFlags::description() const {
  if (!given()) return "";
  switch (truth_kind(truth)) {
    case TruthKind::runs:
      return fmt::format("as {} lists it", truth);
    case TruthKind::matrix:
      return fmt::format("the cells of {}", truth);
    case TruthKind::poses:
      break;
  }
  const PoseTruthOptions of_poses = truth_options(1).poses;
  std::string text = fmt::format("by {}: at most {} m and more than {} frames apart", truth,
                                 of_poses.radius_m, of_poses.min_gap_frames);
  if (of_poses.min_path_m > 0) text += fmt::format(", {} m driven in between", of_poses.min_path_m);
  if (of_poses.max_heading_deg < 180) {
    text += fmt::format(", headings within {} degrees", of_poses.max_heading_deg);
  }
  return text;
}

void TruthFlags::check_kind(TruthKind kind) const {
  if (!protocol.empty() && find_protocol(protocol).truth_kind != kind) {
    throw Error(
        ErrorKind::option,
        fmt::format("--protocol {} requires {}, but '{}' is {}; give another file, or "
                    "leave out the protocol.",
                    protocol, name_of(find_protocol(protocol).truth_kind), truth, name_of(kind)));
  }
  const auto check_flag = [&](bool is_given, const char* flag, const char* things, bool fits) {
    if (!is_given || fits) return;
    throw Error(ErrorKind::option,
                fmt::format("{} applies to {}, but '{}' is {}; leave it out, or give another file.",
                            flag, things, truth, name_of(kind)));
  };
  const bool is_matrix = kind == TruthKind::matrix;
  check_flag(!settings.empty(), "--truth-set", "poses", kind == TruthKind::poses);
  check_flag(views != 1, "--truth-views", "a loop matrix", is_matrix);
  check_flag(!variable.empty(), "--truth-variable", "a loop matrix in a .mat file", is_matrix);
}

void TruthFlags::add_others(GroundTruth& result) const {
  if (!not_false.empty()) {
    const std::vector<PlaceRun> runs = read_place_runs(not_false);
    result.near_place.insert(result.near_place.end(), runs.begin(), runs.end());
  }
  if (!ignore.empty()) {
    const std::vector<int> frames = read_frame_list(ignore);
    result.ignored.insert(result.ignored.end(), frames.begin(), frames.end());
  }
}

std::optional<GroundTruth> TruthFlags::read_truth(const FrameTimes& times_s, int every,
                                                  bool all_read) const {
  if (!given()) return std::nullopt;
  check_kind(truth_kind(truth));
  TruthOptions options = truth_options(every);
  options.all_read = all_read;
  GroundTruth result = loopbit::read_truth(truth, options, times_s);
  add_others(result);
  return result;
}

std::string TruthFlags::poses_file() const {
  if (!poses.empty()) return poses;
  return given() && truth_kind(truth) == TruthKind::poses ? truth : "";
}

Positions TruthFlags::read_positions(const FrameTimes& times_s, int every) const {
  const std::string file = poses_file();
  return file.empty() ? Positions{} : loopbit::read_positions(file, times_s, every);
}

std::string list_truth_settings() {
  std::string list = "Truth by poses (--truth-set NAME=VALUE):\n";
  for_each_field<PoseTruthOptions>([&](const auto& field) {
    list += fmt::format("  {} = {}  [{} to {}] {}\n", field.name, PoseTruthOptions{}.*field.member,
                        field.min, field.max, field.help);
  });
  list += "Protocols (--protocol NAME); numbers of different protocols must not be mixed:\n";
  for (const Protocol& protocol : protocols()) {
    list += fmt::format("  {}: {}\n", protocol.name, protocol.help);
  }
  return list;
}

}  // namespace loopbit::cli
