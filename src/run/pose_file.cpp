// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "pose_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "loopbit/camera_file.hpp"
#include "loopbit/write_file.hpp"

#include "run_files.hpp"

namespace loopbit {
namespace {

constexpr std::array<std::string_view, 6> kAxes{"x", "y", "z", "rx", "ry", "rz"};

/// Calls visit(row, column) with each place of the upper triangle of the covariance, row by row.
template <typename Visit>
void for_each_covariance(const Visit& visit) {
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) visit(row, column);
  }
}

/// Cells of what is not known are empty.
std::string csv_row(PlaceId query, const std::string& match, const RelativePose& pose) {
  const bool is_known = pose.known != PoseKnown::nothing;
  std::string transform = is_known ? to_tum_pose(pose) : std::string(6, ' ');
  std::ranges::replace(transform, ' ', ',');
  std::string row = fmt::format("{},{},{},{},{},{},{},{},{},{}", query, match,
                                to_string(pose.status), to_string(pose.known),
                                to_string(pose.scale), transform, pose.matches, pose.inliers.size(),
                                pose.points, is_known ? fmt::format("{:.4f}", pose.rms_px) : "");
  for_each_covariance(
      [&](int i, int j) { row += is_known ? fmt::format(",{:.9g}", pose.covariance(i, j)) : ","; });
  return row + '\n';
}

}  // namespace

std::string poses_header() {
  std::string text =
      "query,match,status,known,scale,x,y,z,qx,qy,qz,qw,matches,inliers,points,rms_px";
  for_each_covariance([&](int row, int column) {
    text += fmt::format(",cov_{}_{}", kAxes[static_cast<std::size_t>(row)],
                        kAxes[static_cast<std::size_t>(column)]);
  });
  return text;
}

PoseFile::PoseFile(const std::string& folder, const CameraModel& camera, LengthSources lengths)
    : camera_(camera),
      lengths_(std::move(lengths)),
      table_(folder, kPosesFile),
      graph_(folder, kPoseGraphFile),
      matched_(folder, kMatchedPosesFile) {
  table_.append(poses_header() + '\n');
  Lines(folder, kCameraFile).append(to_camera_info(camera));
  matched_.append("# timestamp x y z qx qy qz qw\n");
}

std::span<const LoopPose> PoseFile::add(const Detection& detection, const LoopDetector& detector) {
  const std::size_t before = poses_.size();
  shots_.push_back({detection.name, detection.timestamp_s});
  track_.add(detection.odometry);
  has_odometry_ = has_odometry_ || detection.odometry.has_value();
  for (const LateLoop& loop : detection.late_loops) add_loop(loop, detector);
  if (detection.status == Status::loop) {
    add_loop({.frame = detection.frame,
              .match = detection.match,
              .earlier_match = detection.earlier_match},
             detector);
  }
  return std::span(poses_).subspan(before);
}

void PoseFile::add_loop(const LateLoop& loop, const LoopDetector& detector) {
  const Features query = detector.features_of({0, loop.frame});
  const Features match =
      detector.features_of(loop.earlier_match.value_or(SessionFrame{0, loop.match.value_or(0)}));
  if (query.working_size_px != match.working_size_px) return;
  RelativePose pose = measured(loop, query, match, detector);
  table_.append(csv_row(loop.frame, match_cell(loop), pose));
  add_edge(loop, pose);
  if (pose.known == PoseKnown::metric) {
    const Shot& shot = shots_.at(static_cast<std::size_t>(loop.frame));
    matched_.append(fmt::format(
        "{:.6f} {}\n", shot.time_s.value_or(static_cast<double>(loop.frame)), to_tum_pose(pose)));
  }
  const int inliers = static_cast<int>(pose.inliers.size());
  pose.inliers = {};
  poses_.push_back({loop.frame, loop.match, loop.earlier_match, std::move(pose), inliers});
}

/// With an empty depth image where there should be a length, but nothing gives it.
RelativePose PoseFile::measured(const LateLoop& loop, const Features& query, const Features& match,
                                const LoopDetector& detector) {
  PoseRequest request{.query = {&query, &camera_}, .match = {&match, &camera_}};
  const cv::Mat1f depth_m = depth_of(loop);
  if (lengths_.depth || lengths_.right || has_odometry_) request.match_depth_m = &depth_m;
  Beside beside;
  if (lengths_.right) {
    add_right(loop, beside);
  } else if (has_odometry_ && !lengths_.depth) {
    add_neighbours(loop, detector, beside);
  }
  request.beside = beside.views;
  return estimator_.estimate(request);
}

void PoseFile::add_right(const LateLoop& loop, Beside& beside) {
  if (!loop.match) return;
  const RightCamera& right = lengths_.right->camera();
  const std::string& name = shots_.at(static_cast<std::size_t>(*loop.match)).name;
  beside.features.push_back(lengths_.right->features_of(name));
  if (beside.features.back().keypoints.empty()) return;
  beside.views.push_back({{&beside.features.back(), &right.camera}, right.T_left_right});
}

/// Of a match of this session.
void PoseFile::add_neighbours(const LateLoop& loop, const LoopDetector& detector,
                              Beside& beside) const {
  constexpr double kMinBaseline_m = 0.5;
  constexpr PlaceId kMaxFrames = 300;  // a camera that stands still has no neighbours
  if (!loop.match) return;
  for (const PlaceId step : {-1, 1}) {
    for (PlaceId frame = *loop.match + step;
         frame >= 0 && frame < loop.frame && std::abs(frame - *loop.match) <= kMaxFrames;
         frame += step) {
      const auto motion = track_.between(*loop.match, frame);
      if (!motion) continue;
      const cv::Matx44d& t = motion->T_from_to;
      if (cv::norm(cv::Vec3d(t(0, 3), t(1, 3), t(2, 3))) < kMinBaseline_m) continue;
      Features seen = detector.features_of({0, frame});
      if (seen.keypoints.empty()) continue;
      beside.features.push_back(std::move(seen));
      beside.views.push_back({{&beside.features.back(), &camera_}, t});
      break;
    }
  }
}

/// An edge to another session is left out: its frames have numbers of their own. A vertex comes
/// before its first edge, because g2o skips an edge whose vertices it has not read.
void PoseFile::add_edge(const LateLoop& loop, const RelativePose& pose) {
  if (!loop.match || pose.known == PoseKnown::nothing) return;
  std::string lines;
  for (const PlaceId frame : {*loop.match, loop.frame}) {
    if (!vertices_.insert(frame).second) continue;
    lines += fmt::format("VERTEX_SE3:QUAT {} {}\n", frame, to_tum_pose(cv::Matx44d::eye()));
  }
  graph_.append(lines + to_g2o_edge(pose, *loop.match, loop.frame) + '\n');
}

/// Empty for a match of an earlier session: a map stores no depth.
cv::Mat1f PoseFile::depth_of(const LateLoop& loop) const {
  if (!lengths_.depth || !loop.match) return {};
  const Shot& shot = shots_.at(static_cast<std::size_t>(*loop.match));
  return lengths_.depth->depth_m(shot.name, shot.time_s, camera_.size_px);
}

PoseFile::Lines::Lines(const std::string& folder, const char* name)
    : path_((std::filesystem::path(folder) / name).string()) {
  errno = 0;
  stream_.open(path_, std::ios::binary);
  if (!stream_) throw cannot_write(path_, errno);
}

void PoseFile::Lines::append(const std::string& text) {
  stream_ << text << std::flush;
  if (!stream_) throw cannot_write(path_, errno);
}

}  // namespace loopbit
