// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "run_graph.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/g2o_file.hpp"
#include "loopbit/rigid_motion.hpp"
#include "loopbit/trajectory_error.hpp"
#include "loopbit/write_file.hpp"

#include "run_files.hpp"

namespace loopbit {
namespace {

using LoopKey = std::pair<PlaceId, PlaceId>;  ///< query and match

/// The loops of a run within itself, after all changes, by query.
std::vector<LateLoop> final_loops(const std::vector<Detection>& detections) {
  std::map<LoopKey, double> similarities;
  for (const Detection& detection : detections) {
    if (detection.match) similarities[{detection.frame, *detection.match}] = detection.similarity;
    for (const LateLoop& loop : detection.late_loops) {
      if (loop.match) similarities[{loop.frame, *loop.match}] = loop.similarity;
    }
  }
  std::vector<LateLoop> loops;
  for (const ReportedMatch& match : with_changes(match_list(detections)).matches) {
    if (!match.is_loop) continue;
    loops.push_back({.frame = match.query,
                     .match = match.match,
                     .score = match.score,
                     .similarity = similarities.at({match.query, match.match})});
  }
  std::ranges::stable_sort(loops, {}, &LateLoop::frame);
  return loops;
}

std::string tum_rows(double time_s, const cv::Matx44d& pose) {
  RelativePose written;
  written.T_match_query = pose;
  return fmt::format("{:.6f} {}\n", time_s, to_tum_pose(written));
}

std::string kitti_row(const cv::Matx44d& pose) {
  std::string row;
  for (int i = 0; i < 12; ++i) {
    row += fmt::format("{}{:.9g}", i == 0 ? "" : " ", pose.val[i]);
  }
  return row + '\n';
}

}  // namespace

RunGraph::RunGraph(const std::vector<Detection>& detections, const std::vector<LoopPose>& poses,
                   const OdometryDrift& drift) {
  keyframe_of_.resize(detections.size());
  for (const Detection& detection : detections) {
    if (detection.odometry) add_keyframe(detection, drift);
  }
  if (keyframes_.empty()) {
    throw Error(ErrorKind::input,
                "No frame has odometry, so there is no trajectory to correct: give the odometry of "
                "these images, or do not ask to correct it.");
  }
  add_loops(detections, poses);
  graph_.solve();
}

void RunGraph::add_keyframe(const Detection& detection, const OdometryDrift& drift) {
  const OdometryPose& odometry = *detection.odometry;
  const cv::Matx44d& pose = odometry.T_odometry_camera;
  auto& keyframe = keyframe_of_.at(static_cast<std::size_t>(detection.frame));
  if (keyframes_.empty()) {
    keyframe = graph_.add_keyframe();
  } else {
    const cv::Matx44d step = rigid::inverse(keyframes_.back().T_odometry_camera) * pose;
    keyframe = graph_.add_keyframe(
        {step, odometry.covariance ? *odometry.covariance : drift_covariance(step, drift)});
  }
  keyframes_.push_back({detection.frame, detection.timestamp_s, pose});
}

void RunGraph::add_loops(const std::vector<Detection>& detections,
                         const std::vector<LoopPose>& poses) {
  std::map<LoopKey, const RelativePose*> known;
  for (const LoopPose& loop : poses) {
    if (loop.match) known[{loop.query, *loop.match}] = &loop.pose;
  }
  for (const LateLoop& loop : final_loops(detections)) {
    const auto query = keyframe_of_[static_cast<std::size_t>(loop.frame)];
    const auto match = keyframe_of_[static_cast<std::size_t>(*loop.match)];
    if (!query || !match) {
      ++unjudged_;
      continue;
    }
    const auto pose = known.find({loop.frame, *loop.match});
    graph_.add_loop(
        loop_edge(*match, *query, pose == known.end() ? RelativePose{} : *pose->second));
    loops_.push_back(loop);
  }
}

std::vector<LateLoop> RunGraph::rejected() const {
  std::vector<LateLoop> rejected;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    if (graph_.loops()[i].verdict == LoopVerdict::kept) continue;
    rejected.push_back(loops_[i]);
    rejected.back().score = 0;
  }
  return rejected;
}

/// In the frame of the odometry, from its first pose on.
cv::Matx44d RunGraph::corrected(std::size_t keyframe) const {
  return keyframes_.front().T_odometry_camera * graph_.pose(static_cast<int>(keyframe));
}

std::string RunGraph::trajectory_rows() const {
  std::string text = fmt::format("{}\n", kTrajectoryHeader);
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    text += fmt::format("{},{}", keyframes_[k].frame, k);
    for (const cv::Matx44d& pose : {keyframes_[k].T_odometry_camera, corrected(k)}) {
      const cv::Vec3d at = rigid::translation(pose);
      text += fmt::format(",{:.4f},{:.4f},{:.4f}", at[0], at[1], at[2]);
    }
    text += '\n';
  }
  return text;
}

std::string RunGraph::loop_rows() const {
  std::string text = fmt::format("{}\n", kJudgedLoopsHeader);
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    const JudgedLoop& loop = graph_.loops()[i];
    text +=
        fmt::format("{},{},{},{},{:.3f},{},{},{:.3f},{:.3f}\n", loops_[i].frame, *loops_[i].match,
                    to_string(loop.verdict), to_string(loop.edge.known), loop.odometry_chi2.value(),
                    loop.compared, loop.agreeing, loop.chi2, loop.limit);
  }
  return text;
}

void RunGraph::write(const std::string& folder) const {
  const std::filesystem::path path = folder;
  write_file((path / kTrajectoryFile).string(), trajectory_rows());
  write_file((path / kJudgedLoopsFile).string(), loop_rows());
  write_g2o((path / kGraphFile).string(), graph_);
  std::string tum = "# timestamp x y z qx qy qz qw\n";
  std::string kitti;
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    const Keyframe& keyframe = keyframes_[k];
    tum += tum_rows(keyframe.time_s.value_or(static_cast<double>(keyframe.frame)), corrected(k));
    kitti += kitti_row(corrected(k));
  }
  write_file((path / kCorrectedFile).string(), tum);
  if (keyframes_.size() == keyframe_of_.size()) {
    write_file((path / kCorrectedKittiFile).string(), kitti);
  }
}

Correction RunGraph::results(const std::vector<std::optional<cv::Vec3d>>& positions_m) const {
  Correction results{.keyframes = static_cast<int>(keyframes_.size()), .unjudged = unjudged_};
  for (const JudgedLoop& loop : graph_.loops()) {
    ++results.by_verdict[static_cast<std::size_t>(loop.verdict)];
  }
  std::vector<cv::Vec3d> truth_m;
  std::vector<cv::Vec3d> odometry_m;
  std::vector<cv::Vec3d> corrected_m;
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    const auto frame = static_cast<std::size_t>(keyframes_[k].frame);
    if (frame >= positions_m.size() || !positions_m[frame]) continue;
    truth_m.push_back(*positions_m[frame]);
    odometry_m.push_back(rigid::translation(keyframes_[k].T_odometry_camera));
    corrected_m.push_back(rigid::translation(corrected(k)));
  }
  if (truth_m.size() < 3) return results;
  results.odometry_error_m = absolute_trajectory_error_m(odometry_m, truth_m);
  results.corrected_error_m = absolute_trajectory_error_m(corrected_m, truth_m);
  return results;
}

}  // namespace loopbit
