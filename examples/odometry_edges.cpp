// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
//
// loopbit beside your own odometry: for each loop, also one found late, it prints the edge that a
// pose graph needs, with its information matrix, as a line of g2o.
//
//   odometry_edges INPUT POSES CAMERA    POSES: camera to world, 12 numbers (3 x 4) per image
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <utility>
#include <vector>

#include <loopbit/camera_file.hpp>
#include <loopbit/image_source.hpp>
#include <loopbit/loop_detector.hpp>
#include <loopbit/relative_pose.hpp>

int main(int argc, char** argv) try {
  if (argc != 4) throw std::invalid_argument("usage: odometry_edges INPUT POSES CAMERA");
  std::ifstream odometry(argv[2]);
  const loopbit::CameraModel camera = loopbit::read_camera(argv[3]);
  loopbit::LoopDetector detector;
  loopbit::RelativePoseEstimator estimator;
  std::vector<cv::Matx44d> poses;  // T_world_camera of each image, by the odometry
  const auto source = loopbit::open_source(argv[1]);
  for (loopbit::Frame frame; source->next(frame);) {
    check_size(camera, argv[3], frame.image.size());
    poses.push_back(cv::Matx44d::eye());
    for (int i = 0; i < 12; ++i) odometry >> poses.back().val[i];
    if (!odometry) throw std::invalid_argument("POSES has fewer rows than there are images.");
    const loopbit::Detection found = detector.process(frame.image);
    std::vector<std::pair<int, int>> loops;
    if (found.status == loopbit::Status::loop) loops.emplace_back(found.frame, *found.match);
    for (const loopbit::LateLoop& late : found.late_loops)
      loops.emplace_back(late.frame, *late.match);
    for (const auto& [query, match] : loops) {
      if (match == 0) continue;
      // The images before and after the match are a baseline of known length.
      std::vector<loopbit::Features> seen;
      for (const int i : {query, match, match - 1, match + 1})
        seen.push_back(detector.features_of({0, i}));
      const cv::Matx44d T_match_world = poses[match].inv();
      const std::vector<loopbit::NearbyView> beside{
          {{&seen[2], &camera}, T_match_world * poses[match - 1]},
          {{&seen[3], &camera}, T_match_world * poses[match + 1]}};
      const loopbit::RelativePose edge = estimator.estimate(
          {.query = {&seen[0], &camera}, .match = {&seen[1], &camera}, .beside = beside});
      if (edge.known != loopbit::PoseKnown::metric) continue;
      std::cout << to_g2o_edge(edge, match, query) << '\n';
    }
  }
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
