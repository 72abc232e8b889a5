// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/scoring.hpp"

#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/poses.hpp"
#include "loopbit/protocol.hpp"

namespace loopbit {
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

Scoring ScoringRequest::resolve(const FramesRead& frames, const Scoring& known) const {
  check_fields(known.evaluation.protocol);
  if (!truth.empty()) return {read(frames), evaluation()};
  Scoring scoring = known;
  if (tolerance_frames) scoring.evaluation = evaluation();
  return scoring;
}

void ScoringRequest::check(const FramesRead& frames) const {
  check_fields("");
  if (truth.empty()) return;
  check_kind(truth_kind(truth));
  if (poses_file().empty()) {
    (void)read(frames);
  } else {  // what they say needs the times of the frames
    GroundTruth others;
    add_others(others);
    check_poses(truth, frames);
  }
}

std::string ScoringRequest::description() const {
  if (truth.empty()) return "";
  switch (truth_kind(truth)) {
    case TruthKind::runs:
      return fmt::format("as {} lists it", truth);
    case TruthKind::matrix:
      return fmt::format("the cells of {}", truth);
    case TruthKind::poses:
      break;
  }
  const PoseTruthOptions rule = truth_options().poses;
  std::string text = fmt::format("by {}: at most {} m and more than {} frames apart", truth,
                                 rule.radius_m, rule.min_gap_frames);
  if (rule.min_path_m > 0) text += fmt::format(", {} m driven in between", rule.min_path_m);
  if (rule.max_heading_deg < 180) {
    text += fmt::format(", headings within {} degrees", rule.max_heading_deg);
  }
  return text;
}

std::string ScoringRequest::poses_file(const std::string& given) const {
  if (!given.empty()) return given;
  return !truth.empty() && truth_kind(truth) == TruthKind::poses ? truth : "";
}

void ScoringRequest::check_fields(const std::string& known_protocol) const {
  if (tolerance_frames && *tolerance_frames < 0) {
    throw Error(ErrorKind::option, fmt::format("{} is {}, but must be 0 or more.",
                                               names.tolerance_frames, *tolerance_frames));
  }
  using Given = std::pair<bool, const char*>;
  const Given tolerance{tolerance_frames.has_value(), names.tolerance_frames};
  const Given rule{poses.has_value(), names.poses};
  const Given rows{views.has_value(), names.views};
  if (!protocol.empty()) {
    (void)find_protocol(protocol);
    for (const auto& [is_given, name] : {tolerance, rule, rows}) {
      if (!is_given) continue;
      throw Error(ErrorKind::option,
                  fmt::format("{} cannot be given with {} {}, which fixes it; leave out one of "
                              "them.",
                              name, names.protocol, protocol));
    }
  }
  if (!truth.empty()) return;
  for (const auto& [is_given, name] :
       {Given{!not_false.empty(), names.not_false},
        {!ignore.empty(), names.ignore},
        {protocol != known_protocol && !protocol.empty(), names.protocol},
        rule,
        rows,
        {!variable.empty(), names.variable}}) {
    if (!is_given) continue;
    throw Error(ErrorKind::option,
                fmt::format("{} applies to a file of truth; give {} as the path of a file, or "
                            "leave it out.",
                            name, names.truth));
  }
}

void ScoringRequest::check_kind(TruthKind kind) const {
  if (!protocol.empty() && find_protocol(protocol).truth_kind != kind) {
    throw Error(ErrorKind::option,
                fmt::format("{} {} requires {}, but '{}' is {}; give another file, or leave out "
                            "the protocol.",
                            names.protocol, protocol, name_of(find_protocol(protocol).truth_kind),
                            truth, name_of(kind)));
  }
  const auto check_field = [&](bool is_given, const char* name, const char* things, bool fits) {
    if (!is_given || fits) return;
    throw Error(ErrorKind::option,
                fmt::format("{} applies to {}, but '{}' is {}; leave it out, or give another file.",
                            name, things, truth, name_of(kind)));
  };
  const bool is_matrix = kind == TruthKind::matrix;
  check_field(poses.has_value(), names.poses, "poses", kind == TruthKind::poses);
  check_field(views.value_or(1) != 1, names.views, "a loop matrix", is_matrix);
  check_field(!variable.empty(), names.variable, "a loop matrix in a .mat file", is_matrix);
}

TruthOptions ScoringRequest::truth_options() const {
  TruthOptions options;
  if (!protocol.empty()) options = find_protocol(protocol).truth;
  if (poses) options.poses = *poses;
  if (views) options.views = *views;
  options.variable = variable;
  return options;
}

EvaluationOptions ScoringRequest::evaluation() const {
  if (!protocol.empty()) return find_protocol(protocol).evaluation();
  return {.tolerance_frames = tolerance_frames.value_or(0), .protocol = {}};
}

GroundTruth ScoringRequest::read(const FramesRead& frames) const {
  check_kind(truth_kind(truth));
  GroundTruth result = read_truth(truth, truth_options(), frames);
  add_others(result);
  return result;
}

void ScoringRequest::add_others(GroundTruth& result) const {
  if (!not_false.empty()) {
    const std::vector<PlaceRun> runs = read_place_runs(not_false);
    result.near_place.insert(result.near_place.end(), runs.begin(), runs.end());
  }
  if (!ignore.empty()) {
    const std::vector<int> frames = read_frame_list(ignore);
    result.ignored.insert(result.ignored.end(), frames.begin(), frames.end());
  }
}

}  // namespace loopbit
