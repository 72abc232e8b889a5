// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/finished_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <filesystem>
#include <string_view>

#include <fmt/format.h>
#include <opencv2/core/quaternion.hpp>

#include "loopbit/camera_file.hpp"
#include "loopbit/error.hpp"
#include "loopbit/read_file.hpp"
#include "loopbit/text_rows.hpp"

#include "run_files.hpp"
#include "run_folder.hpp"
#include "run_graph.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

/// The cells of one line of a file of ours, which has no quotes and no spaces.
class Row {
 public:
  Row(const std::string& file, std::size_t line, std::string_view text) : file_(file), line_(line) {
    while (true) {
      const auto comma = text.find(',');
      cells_.push_back(text.substr(0, comma));
      if (comma == std::string_view::npos) break;
      text.remove_prefix(comma + 1);
    }
  }

  [[nodiscard]] std::string_view cell(std::size_t column) const { return cells_[column]; }

  template <typename T>
  [[nodiscard]] T number(std::size_t column) const {
    return number_in<T>(cell(column), column);
  }

  /// `text`: a part of the column's cell.
  template <typename T>
  [[nodiscard]] T number_in(std::string_view text, std::size_t column) const {
    const auto value = parse_number<T>(text);
    if (!value) fail(column);
    if constexpr (std::signed_integral<T>) {
      if (*value < 0) fail(column);
    }
    return *value;
  }

  template <typename T>
  [[nodiscard]] std::optional<T> number_if_any(std::size_t column) const {
    return cell(column).empty() ? std::nullopt : std::optional(number<T>(column));
  }

  void check_columns(std::size_t columns) const {
    if (cells_.size() == columns) return;
    throw Error(ErrorKind::input,
                fmt::format("'{}', line {}, has {} columns, not {}: it was not written by this "
                            "version of loopbit, or changed; run again.",
                            file_, line_, cells_.size(), columns));
  }

  [[noreturn]] void fail(std::size_t column) const {
    throw Error(ErrorKind::input,
                fmt::format("'{}', line {}, column {}, reads '{}': it was changed after loopbit "
                            "wrote it; run again.",
                            file_, line_, column + 1, cell(column).substr(0, 40)));
  }

 private:
  const std::string& file_;
  std::size_t line_;
  std::vector<std::string_view> cells_;
};

/// Calls `visit(Row)` with each whole line of `path` after its header.
template <typename Visit>
void for_each_row(const std::string& path, std::string_view header, const Visit& visit) {
  const std::string text = read_text(path);
  std::string_view rest = text;
  for (std::size_t line = 1;; ++line) {
    const auto end = rest.find('\n');
    if (end == std::string_view::npos) break;
    std::string_view row = rest.substr(0, end);
    if (row.ends_with('\r')) row.remove_suffix(1);
    rest.remove_prefix(end + 1);
    if (line > 1) {
      visit(Row(path, line, row));
    } else if (row != header) {
      throw Error(ErrorKind::input,
                  fmt::format("'{}' does not begin with '{}': it was not written by this version "
                              "of loopbit.",
                              path, header));
    }
  }
}

/// The enumerator that a cell names.
template <typename Enum, std::size_t kSize>
Enum named(const Row& row, std::size_t column, const std::array<Enum, kSize>& all) {
  const auto* const found =
      std::ranges::find_if(all, [&](Enum each) { return to_string(each) == row.cell(column); });
  if (found == all.end()) row.fail(column);
  return *found;
}

/// See match_cell() in run_folder.cpp. `Found`: a Detection, LateLoop or LoopPose.
template <typename Found>
void read_match(const Row& row, std::size_t column, Found& found) {
  const std::string_view cell = row.cell(column);
  const auto colon = cell.find(':');
  if (colon == std::string_view::npos) {
    found.match = row.number_if_any<PlaceId>(column);
    return;
  }
  found.earlier_match = {.session = row.number_in<int>(cell.substr(0, colon), column),
                         .frame = row.number_in<int>(cell.substr(colon + 1), column)};
}

/// All of them or none.
std::optional<ScoreTerms> terms_from(const Row& row, std::size_t column) {
  if (row.cell(column).empty()) return std::nullopt;
  return ScoreTerms{.votes = row.number<double>(column),
                    .geometry = row.number<double>(column + 1),
                    .path = row.number<double>(column + 2),
                    .rivals = row.number<double>(column + 3),
                    .prior = row.number<double>(column + 4)};
}

Detection detection_from(const Row& row) {
  constexpr std::size_t kColumns = 19;
  row.check_columns(kColumns);
  Detection detection{.frame = row.number<PlaceId>(0),
                      .timestamp_s = row.number_if_any<double>(1),
                      .status = named(row, 2, kAllStatuses),
                      .score = row.number<double>(4),
                      .terms = terms_from(row, 8),
                      .similarity = row.number<double>(5),
                      .matches = row.number<int>(6),
                      .inliers = row.number<int>(7),
                      .times = {.content_ms = row.number<double>(15),
                                .retrieval_ms = row.number<double>(16),
                                .features_ms = row.number<double>(17),
                                .verification_ms = row.number<double>(18)},
                      .name = std::string(row.cell(13))};
  read_match(row, 3, detection);
  return detection;
}

/// Puts each late loop where it was reported. A run that was killed may have one more than it has
/// frames.
void read_late_loops(const std::string& path, std::vector<Detection>& detections) {
  constexpr std::size_t kColumns = 8;
  for_each_row(path, kLateLoopsHeader, [&](const Row& row) {
    row.check_columns(kColumns);
    LateLoop loop{.frame = row.number<PlaceId>(0),
                  .score = row.number<double>(3),
                  .similarity = row.number<double>(4)};
    read_match(row, 2, loop);
    const auto reported_at = row.number<std::size_t>(5);
    const bool is_late = row.cell(1) == kLate;
    if (!is_late && row.cell(1) != kWithdrawn) row.fail(1);
    // A loop of the last frame may be withdrawn in its own name: by the pose graph.
    if (static_cast<std::size_t>(loop.frame) + (is_late ? 1 : 0) > reported_at) row.fail(5);
    if (loop.match && *loop.match >= loop.frame) row.fail(2);
    if (reported_at >= detections.size()) return;
    Detection& by = detections[reported_at];
    (is_late ? by.late_loops : by.withdrawn_loops).push_back(loop);
  });
}

std::vector<std::optional<cv::Vec3d>> read_positions(const std::string& path, std::size_t frames) {
  std::vector<std::optional<cv::Vec3d>> positions(frames);
  for_each_row(path, kPositionsHeader, [&](const Row& row) {
    row.check_columns(4);
    const auto frame = row.number<std::size_t>(0);
    if (frame >= frames) return;  // of a run that was cut off
    positions[frame] = {row.number<double>(1), row.number<double>(2), row.number<double>(3)};
  });
  return positions;
}

/// Columns as poses_header() has them.
LoopPose loop_pose_from(const Row& row) {
  constexpr std::size_t kColumns = 16 + 21;
  row.check_columns(kColumns);
  LoopPose loop{.query = row.number<PlaceId>(0), .inliers = row.number<int>(13)};
  read_match(row, 1, loop);
  if (!loop.match && !loop.earlier_match) row.fail(1);
  RelativePose& pose = loop.pose;
  pose.status = named(row, 2, kAllPoseStatuses);
  pose.known = named(row, 3, kAllPoseKnown);
  pose.scale = named(row, 4, kAllScaleStatuses);
  pose.matches = row.number<int>(12);
  pose.points = row.number<int>(14);
  if (pose.known == PoseKnown::nothing) return loop;
  pose.rms_px = row.number<double>(15);
  const cv::Quatd turn(row.number<double>(11), row.number<double>(8), row.number<double>(9),
                       row.number<double>(10));
  constexpr double kMaxRounding = 0.01;
  if (std::abs(turn.norm() - 1) > kMaxRounding) row.fail(8);  // OpenCV throws at 0
  const cv::Matx33d rotation = turn.toRotMat3x3();
  std::size_t column = 16;
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) {
      pose.covariance(i, j) = pose.covariance(j, i) = row.number<double>(column++);
    }
  }
  for (int i = 0; i < 3; ++i) {
    pose.T_match_query(i, 3) = row.number<double>(5 + static_cast<std::size_t>(i));
    for (int j = 0; j < 3; ++j) pose.T_match_query(i, j) = rotation(i, j);
  }
  return loop;
}

CorrectedPosition corrected_from(const Row& row) {
  constexpr std::size_t kColumns = 8;
  row.check_columns(kColumns);
  return {row.number<PlaceId>(0),
          {row.number<double>(2), row.number<double>(3), row.number<double>(4)},
          {row.number<double>(5), row.number<double>(6), row.number<double>(7)}};
}

LoopJudgement judgement_from(const Row& row) {
  constexpr std::size_t kColumns = 9;
  row.check_columns(kColumns);
  return {row.number<PlaceId>(0), row.number<PlaceId>(1), named(row, 2, kAllLoopVerdicts)};
}

/// What --correct wrote, if it did.
void read_correction(const fs::path& folder, FinishedRun& run) {
  const fs::path trajectory = folder / kTrajectoryFile;
  if (is_there(trajectory)) {
    for_each_row(trajectory.string(), kTrajectoryHeader,
                 [&](const Row& row) { run.trajectory.push_back(corrected_from(row)); });
  }
  const fs::path loops = folder / kJudgedLoopsFile;
  if (is_there(loops)) {
    for_each_row(loops.string(), kJudgedLoopsHeader,
                 [&](const Row& row) { run.judged_loops.push_back(judgement_from(row)); });
  }
}

/// Throws Error (kind input) if the run has ended, but loops.csv has not a row for each frame.
void check_all_frames_are_there(const FinishedRun& run) {
  const RunRecord& record = *run.record;
  if (!record.has_ended() || !record.results) return;
  const auto expected = static_cast<std::size_t>(record.results->frames);
  if (run.detections.size() == expected) return;
  throw Error(ErrorKind::input,
              fmt::format("'{}' has {} rows, but {} counts {} frames: it was cut off or changed; "
                          "copy it again, or repeat the run.",
                          (fs::path(run.path) / kLoopsFile).string(), run.detections.size(),
                          kRecordFile, expected));
}

}  // namespace

std::vector<Detection> read_detections(const std::string& path) {
  std::vector<Detection> detections;
  for_each_row(path, kLoopsHeader, [&](const Row& row) {
    detections.push_back(detection_from(row));
    if (detections.back().frame != static_cast<PlaceId>(detections.size()) - 1) row.fail(0);
  });
  return detections;
}

FinishedRun read_run(const std::string& path) {
  const fs::path folder = path;
  if (!is_there(folder / kLoopsFile)) {
    throw Error(ErrorKind::input,
                fmt::format("'{}' holds no run: there is no {} in it; name a folder that 'loopbit "
                            "run' or 'loopbit demo' wrote.",
                            path, kLoopsFile));
  }
  FinishedRun run;
  run.path = path;
  run.detections = read_detections((folder / kLoopsFile).string());
  if (is_there(folder / kLateLoopsFile)) {
    read_late_loops((folder / kLateLoopsFile).string(), run.detections);
  }
  if (is_there(folder / kRecordFile)) {
    const std::string file = (folder / kRecordFile).string();
    run.record_json = read_text(file);
    run.record = run_record_from_json(run.record_json, file);
    check_all_frames_are_there(run);
  }
  if (is_there(folder / kTruthFile)) {
    run.truth = {.same_place = read_place_runs((folder / kTruthFile).string()),
                 .near_place = read_place_runs((folder / kNotFalseFile).string()),
                 .ignored = read_frame_list((folder / kIgnoreFile).string()),
                 .every = run.record ? run.record->truth_every : 1};
    const fs::path unknown = folder / kUnknownFile;  // which earlier versions did not write
    if (is_there(unknown)) run.truth->unknown = read_frame_list(unknown.string());
  }
  if (is_there(folder / kPositionsFile)) {
    run.positions_m = read_positions((folder / kPositionsFile).string(), run.detections.size());
  }
  if (is_there(folder / kPosesFile)) {
    for_each_row((folder / kPosesFile).string(), poses_header(),
                 [&](const Row& row) { run.poses.push_back(loop_pose_from(row)); });
  }
  read_correction(folder, run);
  if (is_there(folder / kCameraFile)) run.camera = read_camera((folder / kCameraFile).string());
  if (is_there(folder / kEvidenceFile)) run.evidence_path = (folder / kEvidenceFile).string();
  return run;
}

FramesRead FinishedRun::frames() const {
  FramesRead frames;
  for (const Detection& detection : detections) frames.times_s.push_back(detection.timestamp_s);
  if (!record) return frames;
  frames.every = record->sampling.every;
  frames.all = record->stopped_by == "end" && record->sampling.limit == 0;
  return frames;
}

Scoring FinishedRun::scoring() const {
  const bool was_scored = record && record->score;
  return {truth, was_scored ? record->score->options : EvaluationOptions{}};
}

MatchList match_list(const std::vector<Detection>& detections) {
  MatchList list;
  list.times_s.reserve(detections.size());
  const auto add_changes = [&](const std::vector<LateLoop>& loops, bool is_loop) {
    for (const LateLoop& loop : loops) {
      list.changes.push_back({.query = loop.frame,
                              .match = loop.match.value_or(-1),
                              .score = loop.score,
                              .is_loop = is_loop});
    }
  };
  for (const Detection& detection : detections) {
    add_changes(detection.withdrawn_loops, false);
    add_changes(detection.late_loops, true);
    list.times_s.push_back(detection.timestamp_s);
    const bool is_loop = detection.status == Status::loop;
    if (detection.earlier_match && is_loop) list.elsewhere.push_back(detection.frame);
    if (!detection.match) continue;
    list.matches.push_back({.query = detection.frame,
                            .match = *detection.match,
                            .score = detection.score,
                            .is_loop = is_loop});
  }
  return list;
}

std::string image_pairs(const std::vector<Detection>& detections) {
  const auto name_of = [&](PlaceId frame) {
    const std::string& name = detections.at(static_cast<std::size_t>(frame)).name;
    // loops.csv writes other characters as "\x2c".
    if (name.empty() || name.find(' ') != std::string::npos ||
        name.find("\\x") != std::string::npos) {
      throw Error(ErrorKind::input,
                  fmt::format("Frame {} is called '{}', but a list of pairs needs a name without "
                              "spaces, commas and quotes: run on image files with such names.",
                              frame, name));
    }
    return name;
  };
  std::string text;
  for (const ReportedMatch& loop : with_changes(match_list(detections)).matches) {
    if (loop.is_loop) text += fmt::format("{} {}\n", name_of(loop.query), name_of(loop.match));
  }
  return text;
}

}  // namespace loopbit
