// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "truth_flags.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/poses.hpp"
#include "loopbit/protocol.hpp"

#include "commands.hpp"
#include "ranges.hpp"

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

bool has_times(const std::vector<CameraPose>& poses) {
  return std::any_of(poses.begin(), poses.end(),
                     [](const CameraPose& pose) { return pose.timestamp_s.has_value(); });
}

/// The rows of the frames that were read, where row and frame go together by number.
std::vector<CameraPose> rows_read(const std::vector<CameraPose>& poses, std::size_t frames,
                                  int every) {
  std::vector<CameraPose> rows;
  rows.reserve(frames);
  const auto step = static_cast<std::size_t>(every);
  for (std::size_t row = 0; row < poses.size() && rows.size() < frames; row += step) {
    rows.push_back(poses[row]);
  }
  return rows;
}

}  // namespace

void TruthFlags::add_to(CLI::App& command) {
  CLI::Option* option_truth =
      command
          .add_option("--truth", truth,
                      "What is true: CSV of query,first,last or query,match; KITTI poses or a TUM "
                      "trajectory; a loop matrix as .mat, text or image")
          ->type_name("FILE");
  command
      .add_option("--not-false", not_false,
                  "Matches that are not wrong, nor right by this alone; CSV as above")
      ->type_name("FILE")
      ->needs(option_truth);
  command.add_option("--ignore", ignore, "Queries that are not scored, one a line")
      ->type_name("FILE")
      ->needs(option_truth);
  command.add_option("--protocol", protocol, "A published way of scoring, listed below")
      ->type_name("NAME")
      ->needs(option_truth);
  fixed_by_protocol_[0] =
      command
          .add_option("--tolerance", tolerance_frames,
                      "A match is right so many frames before or after a true place, too")
          ->type_name("N")
          ->check(whole_number(0, 1'000'000));
  fixed_by_protocol_[1] =
      command.add_option("--truth-set", settings, "One setting of truth by poses; may be repeated")
          ->type_name("NAME=VALUE")
          ->allow_extra_args(false);
  fixed_by_protocol_[2] =
      command
          .add_option("--truth-views", views, "Rows a frame has in a loop matrix (2: left, right)")
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
  command.add_option("--poses", poses, "KITTI poses or a TUM trajectory, for the report's map")
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

TruthOptions TruthFlags::truth_options() const {
  TruthOptions options;
  options.views = views;
  for (const std::string& setting : settings) {
    const auto [name, value] = split_setting(setting);
    if (!set_field(options.poses, "truth", name, value)) {
      throw Error(ErrorKind::option,
                  fmt::format("There is no setting '{}' of truth by poses; --help lists those "
                              "there are.",
                              name));
    }
  }
  if (!protocol.empty()) options = find_protocol(protocol).truth;
  options.variable = variable;
  return options;
}

void TruthFlags::check() const {
  (void)evaluation();
  (void)truth_options();
  // A trajectory can be read only with the times of the frames.
  if (const std::string file = poses_file(); !file.empty()) (void)read_poses(file);
  if (!given()) return;
  if (const TruthKind kind = truth_kind(truth); kind == TruthKind::poses) {
    check_protocol(kind);
    (void)read_others(1);
  } else {
    (void)read_truth({}, 1);
  }
}

void TruthFlags::check_protocol(TruthKind kind) const {
  if (protocol.empty() || find_protocol(protocol).truth_kind == kind) return;
  throw Error(
      ErrorKind::option,
      fmt::format("--protocol {} is defined on {}, but '{}' is {}; name another file, or "
                  "leave out the protocol.",
                  protocol, name_of(find_protocol(protocol).truth_kind), truth, name_of(kind)));
}

GroundTruth TruthFlags::read_others(int every) const {
  GroundTruth others;
  if (!not_false.empty()) others.near_place = read_place_runs(not_false);
  if (!ignore.empty()) others.ignored = read_frame_list(ignore);
  return every_nth(others, every);
}

std::optional<GroundTruth> TruthFlags::read_truth(const FrameTimes& times_s, int every) const {
  if (!given()) return std::nullopt;
  const TruthKind kind = truth_kind(truth);
  check_protocol(kind);
  // A trajectory goes by the frames' times, all else by their numbers in the whole sequence.
  const bool goes_by_time = kind == TruthKind::poses && has_times(read_poses(truth));
  GroundTruth result;
  if (goes_by_time || every == 1) {
    result = loopbit::read_truth(truth, truth_options(), times_s);
  } else {
    result = every_nth(loopbit::read_truth(truth, truth_options()), every);
  }
  const GroundTruth others = read_others(every);
  result.near_place.insert(result.near_place.end(), others.near_place.begin(),
                           others.near_place.end());
  result.ignored.insert(result.ignored.end(), others.ignored.begin(), others.ignored.end());
  return result;
}

std::string TruthFlags::poses_file() const {
  if (!poses.empty()) return poses;
  return given() && truth_kind(truth) == TruthKind::poses ? truth : "";
}

Positions TruthFlags::read_positions(const FrameTimes& times_s, int every) const {
  const std::string file = poses_file();
  if (file.empty()) return {};
  std::vector<CameraPose> rows = read_poses(file);
  if (times_s.empty() && has_times(rows)) return {};
  const std::size_t frames = times_s.empty() ? rows.size() : times_s.size();
  if (!has_times(rows)) rows = rows_read(rows, frames, every);
  Positions positions;
  positions.reserve(frames);
  for (const auto& pose : poses_of_frames(rows, times_s.empty() ? FrameTimes(frames) : times_s)) {
    positions.push_back(pose ? std::optional(pose->position_m) : std::nullopt);
  }
  return positions;
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
