// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/truth_file.hpp"

#include <cstddef>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/image_file.hpp"
#include "loopbit/text_rows.hpp"

#include "camera_poses.hpp"
#include "mat_file.hpp"
#include "truth_matrix.hpp"
#include "truth_rows.hpp"

namespace loopbit {
namespace {

using truth::TruthMatrix;

constexpr std::size_t kFewestMatrixColumns = 13;
constexpr const char* kNoPlace =
    "has no true place, so every loop would be wrong: give the truth of this sequence. If it has "
    "no revisit, give a file whose only row is query,first,last.";

/// Any of its channels.
template <typename Level>
bool is_set(const Level* pixel, int channels) {
  for (int i = 0; i < channels; ++i) {
    if (pixel[i] != 0) return true;
  }
  return false;
}

template <typename Level>
void add_pixels(const cv::Mat& image, TruthMatrix& matrix) {
  const int channels = image.channels();
  for (int y = 0; y < image.rows; ++y) {
    const auto* row = image.ptr<Level>(y);
    for (int x = 0; x < image.cols; ++x) {
      if (is_set(row + static_cast<std::ptrdiff_t>(x) * channels, channels)) {
        matrix.add(static_cast<std::size_t>(y), static_cast<std::size_t>(x));
      }
    }
  }
}

TruthMatrix read_mask_matrix(const std::string& path, int views) {
  const std::string extension = images::lower_extension(path);
  if (extension == ".jpg" || extension == ".jpeg") {
    throw Error(ErrorKind::input,
                fmt::format("Mask '{}' is a JPEG image, whose black is not quite black: give the "
                            "original as PNG or .mat.",
                            path));
  }
  constexpr int kMaxMegapixels = 1000;  // a row of pixels for each of 30,000 images
  const cv::Mat image = images::read_image_file(path, kMaxMegapixels);
  const auto rows = static_cast<std::size_t>(image.rows);
  TruthMatrix matrix(fmt::format("Mask '{}'", path), {rows, static_cast<std::size_t>(image.cols)},
                     views);
  if (image.depth() == CV_16U) {
    add_pixels<std::uint16_t>(image, matrix);
  } else {
    add_pixels<std::uint8_t>(image, matrix);
  }
  return matrix;
}

TruthMatrix parse_matrix(const std::string& path, const std::vector<TextRow>& rows, int views) {
  TruthMatrix matrix(fmt::format("Matrix '{}'", path), {rows.size(), rows.size()}, views);
  std::vector<std::string_view> cells;
  for (std::size_t y = 0; y < rows.size(); ++y) {
    split_cells(rows[y].text, cells);
    if (cells.size() != rows.size()) {
      throw_bad_row(path, rows[y],
                    fmt::format("{0} numbers, one for each of the {0} rows (not {1})", rows.size(),
                                cells.size()));
    }
    for (std::size_t x = 0; x < cells.size(); ++x) {
      if (cells[x] == "0") continue;
      const auto number = parse_number<double>(cells[x]);
      if (!number) {
        throw_bad_row(path, rows[y], fmt::format("all numbers, which '{}' is not", cells[x]));
      }
      if (*number != 0.0) matrix.add(y, x);
    }
  }
  return matrix;
}

/// Of the frames of a matrix with so many views every so-many-th was read.
int every_of_matrix(int every, int views) {
  if (every == 1) return 1;
  if (every % views == 0) return every / views;
  throw Error(ErrorKind::option,
              fmt::format("Every {}-th image was read, but a frame of the matrix is {} images in "
                          "turn; read every {}-th, or all.",
                          every, views, views));
}

GroundTruth truth_of(const TruthMatrix& matrix, const std::string& path, int views_per_frame,
                     FramesRead frames) {
  frames.every = every_of_matrix(frames.every, views_per_frame);
  const std::size_t count = frames.times_s.size();
  const auto views = static_cast<std::size_t>(views_per_frame);
  if (frames.every < views_per_frame && count > matrix.frames() &&
      count <= matrix.frames() * views) {
    throw Error(ErrorKind::input,
                fmt::format("'{}' has {} frames of {} rows each, and {} images were read: where "
                            "these are its views in turn, read every {}-th.",
                            path, matrix.frames(), views, count, views));
  }
  truth::check_rows(path, matrix.frames(), "frames", frames);
  GroundTruth truth{.same_place = matrix.runs(),
                    .every = frames.every,
                    .frames = static_cast<int>(matrix.frames())};
  if (!truth.same_place.empty()) return truth;
  throw Error(ErrorKind::input, fmt::format("'{}' {}", path, kNoPlace));
}

/// In the numbers of the whole sequence what is in those of the frames read.
GroundTruth in_sequence(GroundTruth truth, int every) {
  for (auto* runs : {&truth.same_place, &truth.near_place}) {
    for (PlaceRun& run : *runs) run = {run.query * every, run.first * every, run.last * every};
  }
  for (int& frame : truth.unknown) frame *= every;
  truth.every = every;
  return truth;
}

GroundTruth truth_by_time(const std::vector<CameraPose>& poses, const PoseTruthOptions& options,
                          const FramesRead& frames) {
  PoseTruthOptions of_frames_read = options;
  of_frames_read.min_gap_frames /= frames.every;
  return in_sequence(truth_from_poses(poses_of_frames(poses, frames.times_s), of_frames_read),
                     frames.every);
}

GroundTruth read_pose_truth(const std::string& path, const PoseTruthOptions& options,
                            const FramesRead& frames) {
  const std::vector<CameraPose> poses = read_poses(path);
  const bool poses_timed = poses.front().timestamp_s.has_value();
  if (poses_timed && frames.times_s.empty()) {
    throw Error(ErrorKind::input,
                fmt::format("Trajectory '{}' tells poses by time: give the sequence as well, with "
                            "the times of its frames, as a run's folder or a list with the columns "
                            "frame and timestamp has them.",
                            path));
  }
  if (poses_timed && truth::has_times(frames)) {
    return truth::made_of_file(path, [&] { return truth_by_time(poses, options, frames); });
  }
  if (poses_timed) truth::check_pose_each(path, poses.size(), frames);
  truth::check_rows(path, poses.size(), "poses", frames);
  GroundTruth truth = truth::made_of_file(path, [&] {
    return truth_from_poses({poses.begin(), poses.end()}, options);
  });
  truth.every = frames.every;
  truth.frames = static_cast<int>(poses.size());
  return truth;
}

GroundTruth read_run_truth(const std::string& path, const FramesRead& frames) {
  GroundTruth truth{.same_place = read_place_runs(path), .every = frames.every};
  for (const PlaceRun& run : truth.same_place) truth::check_frame(path, run.query, frames);
  return truth;
}

/// The kind of a text file by its first row. Throws if it is none.
TruthKind text_kind(const std::string& path, const std::vector<TextRow>& rows) {
  if (rows.empty()) throw Error(ErrorKind::input, fmt::format("'{}' {}", path, kNoPlace));
  std::vector<std::string_view> cells;
  split_cells(rows.front().text, cells);
  if (cells.size() == 2 || cells.size() == 3) return TruthKind::runs;
  const bool is_square = cells.size() == rows.size();
  if (cells.size() == truth::kTumColumns || cells.size() == truth::kKittiColumns ||
      (cells.size() == truth::kEurocColumns && !is_square)) {
    return TruthKind::poses;
  }
  if (cells.size() >= kFewestMatrixColumns && is_square) return TruthKind::matrix;
  throw_bad_row(
      path, rows.front(),
      fmt::format("query,first,last, or query,match, or a pose of 12 (KITTI), 8 (TUM) or 17 "
                  "(EuRoC) numbers, or {} numbers, as many as the file has rows (at least 13): a "
                  "square matrix",
                  rows.size()));
}

bool is_mat_file(const std::string& path) { return images::lower_extension(path) == ".mat"; }

}  // namespace

TruthKind truth_kind(const std::string& path) {
  if (is_mat_file(path) || images::is_image_name(path)) return TruthKind::matrix;
  return text_kind(path, read_rows(path));
}

GroundTruth read_truth(const std::string& path, const TruthOptions& options,
                       const FramesRead& frames) {
  if (options.views < 1) {
    throw Error(ErrorKind::option,
                fmt::format("views is {}, but must be 1 (a row a frame) or more.", options.views));
  }
  check_every(frames.every);
  if (static_cast<double>(frames.times_s.size()) * frames.every > std::numeric_limits<int>::max()) {
    throw Error(ErrorKind::option, fmt::format("every is {}, but no frame's number may be over {}.",
                                               frames.every, std::numeric_limits<int>::max()));
  }
  if (is_mat_file(path)) {
    return truth_of(truth::read_mat_file(path, options.variable, options.views), path,
                    options.views, frames);
  }
  if (images::is_image_name(path)) {
    return truth_of(read_mask_matrix(path, options.views), path, options.views, frames);
  }
  const std::vector<TextRow> rows = read_rows(path);
  switch (text_kind(path, rows)) {
    case TruthKind::runs:
      return read_run_truth(path, frames);
    case TruthKind::poses:
      return read_pose_truth(path, options.poses, frames);
    case TruthKind::matrix:
      return truth_of(parse_matrix(path, rows, options.views), path, options.views, frames);
  }
  return {};
}

}  // namespace loopbit
