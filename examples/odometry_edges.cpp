// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
//
// loopbit beside your own odometry: for each loop it prints the edge that a pose graph needs, with
// its information matrix, as a line of g2o.
//
//   odometry_edges INPUT POSES CAMERA    POSES: camera to world, 12 numbers (3 x 4) per image
#include <fstream>
#include <iostream>
#include <vector>

#include <loopbit/camera_file.hpp>
#include <loopbit/error.hpp>
#include <loopbit/gray_image.hpp>
#include <loopbit/image_source.hpp>
#include <loopbit/loop_detector.hpp>
#include <loopbit/relative_pose.hpp>

namespace {

void run(const char* input, const char* poses, const char* camera_file) {
  const loopbit::CameraModel camera = loopbit::read_camera(camera_file);
  std::ifstream odometry(poses);
  loopbit::LoopDetector detector;
  loopbit::RelativePoseEstimator estimator;
  std::vector<loopbit::Features> features;  // of each image
  std::vector<cv::Matx44d> T_world_camera;  // by the odometry
  const auto source = loopbit::open_source(input);
  for (loopbit::Frame frame; source->next(frame);) {
    check_size(camera, camera_file, frame.image.size());
    features.push_back(loopbit::extract_surf(loopbit::gray_image(frame.image)));
    cv::Matx44d pose = cv::Matx44d::eye();
    for (int i = 0; i < 12; ++i) odometry >> pose.val[i];
    T_world_camera.push_back(pose);
    const loopbit::Detection loop = detector.process(frame.image);
    if (loop.status != loopbit::Status::loop || !loop.match || *loop.match == 0) continue;
    // The images before and after the match are a baseline of known length.
    const auto match = static_cast<std::size_t>(*loop.match);
    std::vector<loopbit::NearbyView> beside;
    for (const std::size_t i : {match - 1, match + 1}) {
      beside.push_back({{&features[i], &camera}, T_world_camera[match].inv() * T_world_camera[i]});
    }
    const loopbit::RelativePose edge = estimator.estimate({.query = {&features.back(), &camera},
                                                           .match = {&features[match], &camera},
                                                           .matches = {},
                                                           .beside = beside});
    if (edge.known == loopbit::PoseKnown::metric) {
      std::cout << to_g2o_edge(edge, *loop.match, loop.frame) << '\n';
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: odometry_edges INPUT POSES CAMERA\n";
    return 2;
  }
  try {
    run(argv[1], argv[2], argv[3]);
  } catch (const loopbit::Error& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
