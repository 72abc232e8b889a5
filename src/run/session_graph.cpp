// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "session_graph.hpp"

#include <cstddef>
#include <filesystem>

#include <fmt/format.h>

#include "loopbit/g2o_file.hpp"
#include "loopbit/rigid_motion.hpp"
#include "loopbit/write_file.hpp"

#include "run_files.hpp"

namespace loopbit {
namespace {

std::string frame_cell(const SessionFrame& at) {
  return at.session == 0 ? fmt::format("{}", at.frame) : fmt::format("{}:{}", at.session, at.frame);
}

/// "corrected_2.tum" of "corrected.tum" and session 2.
std::string file_of(const std::string& folder, const char* name, int session) {
  const std::filesystem::path file = name;
  const std::string number = session == 0 ? "" : fmt::format("_{}", session);
  return (std::filesystem::path(folder) /
          (file.stem().string() + number + file.extension().string()))
      .string();
}

std::string tum_row(double time_s, const cv::Matx44d& pose) {
  return fmt::format("{:.6f} {}\n", time_s, to_tum_pose(pose));
}

std::string kitti_row(const cv::Matx44d& pose) {
  std::string row;
  for (int i = 0; i < 12; ++i) {
    row += fmt::format("{}{:.9g}", i == 0 ? "" : " ", pose.val[i]);
  }
  return row + '\n';
}

}  // namespace

void SessionGraph::add_frame(const SessionFrame& at, std::optional<double> time_s,
                             const OdometryPose& odometry, const OdometryDrift& drift) {
  const bool continues = !keyframes_.empty() && keyframes_.back().at.session == at.session;
  keyframe_of_[{at.session, at.frame}] =
      continues
          ? graph_.add_keyframe(odometry_step(keyframes_.back().T_odometry_camera, odometry, drift))
          : graph_.add_keyframe();
  keyframes_.push_back({at, time_s, odometry.T_odometry_camera});
}

bool SessionGraph::add_loop(const SessionFrame& query, const SessionFrame& match,
                            const KnownMotion& motion) {
  const auto from = keyframe_of_.find({match.session, match.frame});
  const auto to = keyframe_of_.find({query.session, query.frame});
  if (from == keyframe_of_.end() || to == keyframe_of_.end() || from == to) {
    ++unjudged_;
    return false;
  }
  graph_.add_loop({.match = from->second,
                   .query = to->second,
                   .known = motion.known,
                   .T_match_query = motion.motion.T_from_to,
                   .covariance = motion.motion.covariance});
  return true;
}

void SessionGraph::solve() {
  graph_.solve();
  worlds_ = graph_.worlds();
}

cv::Matx44d SessionGraph::corrected(std::size_t keyframe) const {
  const Keyframe& world = keyframes_[static_cast<std::size_t>(worlds_[keyframe])];
  return world.T_odometry_camera * graph_.pose(static_cast<int>(keyframe));
}

int SessionGraph::world_of(std::size_t keyframe) const {
  return keyframes_[static_cast<std::size_t>(worlds_[keyframe])].at.session;
}

Correction SessionGraph::results() const {
  Correction results{.keyframes = static_cast<int>(keyframes_.size()), .unjudged = unjudged_};
  for (const JudgedLoop& loop : graph_.loops()) {
    ++results.by_verdict[static_cast<std::size_t>(loop.verdict)];
  }
  return results;
}

std::string SessionGraph::trajectory_rows() const {
  std::string text = fmt::format("{}\n", kTrajectoryHeader);
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    text += fmt::format("{},{}", frame_cell(keyframes_[k].at), k);
    for (const cv::Matx44d& pose : {keyframes_[k].T_odometry_camera, corrected(k)}) {
      const cv::Vec3d at = rigid::translation(pose);
      text += fmt::format(",{:.4f},{:.4f},{:.4f}", at[0], at[1], at[2]);
    }
    text += '\n';
  }
  return text;
}

std::string SessionGraph::loop_rows() const {
  const auto cell_of = [&](int keyframe) {
    return frame_cell(keyframes_[static_cast<std::size_t>(keyframe)].at);
  };
  std::string text = fmt::format("{}\n", kJudgedLoopsHeader);
  for (const JudgedLoop& loop : graph_.loops()) {
    text +=
        fmt::format("{},{},{},{},{},{},{},{:.3f},{:.3f}\n", cell_of(loop.edge.query),
                    cell_of(loop.edge.match), to_string(loop.verdict), to_string(loop.edge.known),
                    loop.odometry_chi2 ? fmt::format("{:.3f}", *loop.odometry_chi2) : "",
                    loop.compared, loop.agreeing, loop.chi2, loop.limit);
  }
  return text;
}

void SessionGraph::write(const std::string& folder,
                         const std::map<int, std::int64_t>& frames) const {
  write_file(file_of(folder, kTrajectoryFile, 0), trajectory_rows());
  write_file(file_of(folder, kJudgedLoopsFile, 0), loop_rows());
  write_g2o(file_of(folder, kGraphFile, 0), graph_);
  for (std::size_t k = 0; k < keyframes_.size();) {
    const int session = keyframes_[k].at.session;
    const std::size_t first = k;
    std::string tum = "# timestamp x y z qx qy qz qw\n";
    std::string kitti;
    for (; k < keyframes_.size() && keyframes_[k].at.session == session; ++k) {
      const Keyframe& keyframe = keyframes_[k];
      tum += tum_row(keyframe.time_s.value_or(keyframe.at.frame), corrected(k));
      kitti += kitti_row(corrected(k));
    }
    write_file(file_of(folder, kCorrectedFile, session), tum);
    if (static_cast<std::int64_t>(k - first) == frames.at(session)) {
      write_file(file_of(folder, kCorrectedKittiFile, session), kitti);
    }
  }
}

}  // namespace loopbit
