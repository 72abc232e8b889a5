// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/relative_pose.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "loopbit/kernels_for.hpp"
#include "loopbit/ray_geometry.hpp"

#include "direction_kernels.hpp"
#include "pose_fit.hpp"
#include "ray_blocks.hpp"
#include "test_cameras.hpp"
#include "test_support.hpp"

namespace loopbit {

std::ostream& operator<<(std::ostream& stream, PoseStatus status) {
  return stream << to_string(status);
}
std::ostream& operator<<(std::ostream& stream, PoseKnown known) {
  return stream << to_string(known);
}
std::ostream& operator<<(std::ostream& stream, ScaleStatus scale) {
  return stream << to_string(scale);
}

namespace test {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kScale = 3;  // of each keypoint

cv::Matx44d transform(const cv::Vec3d& turn, const cv::Vec3d& t) {
  const cv::Matx33d r = rotation_by(turn);
  return {r(0, 0), r(0, 1), r(0, 2), t[0], r(1, 0), r(1, 1), r(1, 2), t[1],
          r(2, 0), r(2, 1), r(2, 2), t[2], 0,       0,       0,       1};
}

cv::Vec3d translation_of(const cv::Matx44d& pose) { return {pose(0, 3), pose(1, 3), pose(2, 3)}; }

cv::Vec3d moved(const cv::Matx44d& pose, const cv::Vec3d& point) {
  return pose.get_minor<3, 3>(0, 0) * point + translation_of(pose);
}

double rotation_error_deg(const cv::Matx44d& a, const cv::Matx44d& b) {
  const cv::Matx33d turn = a.get_minor<3, 3>(0, 0).t() * b.get_minor<3, 3>(0, 0);
  const cv::Vec3d axis(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
  return std::atan2(cv::norm(axis) / 2, (cv::trace(turn) - 1) / 2) * kDegrees;
}

double direction_error_deg(const cv::Matx44d& a, const cv::Matx44d& b) {
  const cv::Vec3d u = translation_of(a);
  const cv::Vec3d v = translation_of(b);
  return std::atan2(cv::norm(u.cross(v)), u.dot(v)) * kDegrees;
}

/// Points before a camera at the origin, from 4 to 20 m.
std::vector<cv::Vec3d> points_in_space(int count, Random& random) {
  std::vector<cv::Vec3d> points;
  for (int i = 0; i < count; ++i) {
    const double z = 4 + 16 * random.uniform();
    points.emplace_back((random.uniform() - 0.5) * z, (random.uniform() - 0.5) * 0.7 * z, z);
  }
  return points;
}

/// Feature k shows point k, with noise in standard deviations of a keypoint.
Features features_of(const CameraModel& camera, const cv::Matx44d& T_camera_match,
                     const std::vector<cv::Vec3d>& points, double noise, Random& random) {
  Features features;
  features.working_size_px = camera.size_px;
  for (const cv::Vec3d& point : points) {
    const cv::Vec2d pixel = project(camera, moved(T_camera_match, point)).value_or(cv::Vec2d());
    const double sigma_px = noise * keypoint_sigma_px({.scale = static_cast<float>(kScale)});
    features.keypoints.push_back({.x_px = static_cast<float>(pixel[0] + sigma_px * random.normal()),
                                  .y_px = static_cast<float>(pixel[1] + sigma_px * random.normal()),
                                  .scale = static_cast<float>(kScale)});
  }
  return features;
}

/// Two views of the same points.
struct Scene {
  CameraModel camera = pinhole();
  cv::Matx44d T_match_query = transform({0.02, -0.15, 0.03}, {0.9, -0.1, 0.5});
  std::vector<cv::Vec3d> points;  ///< in the frame of the match
  Features query;
  Features match;
  std::vector<Match> matches;

  Scene(std::vector<cv::Vec3d> seen, const CameraModel& model, const cv::Matx44d& pose,
        double noise, Random& random)
      : camera(model), T_match_query(pose), points(std::move(seen)) {
    query = features_of(camera, T_match_query.inv(), points, noise, random);
    match = features_of(camera, cv::Matx44d::eye(), points, noise, random);
    for (int i = 0; i < static_cast<int>(points.size()); ++i) matches.push_back({i, i});
  }

  [[nodiscard]] PoseRequest request() const {
    return {.query = {&query, &camera}, .match = {&match, &camera}, .matches = matches};
  }
};

cv::Matx44d usual_motion() { return transform({0.02, -0.15, 0.03}, {0.9, -0.1, 0.5}); }

RelativePose estimate(const PoseRequest& request) {
  return RelativePoseEstimator().estimate(request);
}

/// As the estimator sees it: the inverse depths of the points, with an image of 1 m tall steps.
cv::Mat1f depth_image(const Scene& scene) {
  cv::Mat1f depth_m(scene.camera.size_px, 0.0F);
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const Keypoint& at = scene.match.keypoints[i];
    const cv::Rect patch(static_cast<int>(at.x_px) - 1, static_cast<int>(at.y_px) - 1, 4, 4);
    depth_m(patch & cv::Rect({0, 0}, scene.camera.size_px)) =
        static_cast<float>(scene.points[i][2]);
  }
  return depth_m;
}

/// The squared error in units of the covariance.
double nees(const RelativePose& pose, const cv::Matx44d& truth, int freedom) {
  cv::Matx44d exact = truth;
  if (pose.known == PoseKnown::direction) {
    const double length = cv::norm(translation_of(truth));
    for (int row = 0; row < 3; ++row) exact(row, 3) /= length;
  }
  const cv::Matx44d error = pose.T_match_query.inv() * exact;
  const cv::Vec6d all(error(0, 3), error(1, 3), error(2, 3), (error(2, 1) - error(1, 2)) / 2,
                      (error(0, 2) - error(2, 0)) / 2, (error(1, 0) - error(0, 1)) / 2);
  cv::Vec6d values;
  cv::Matx66d vectors;
  cv::eigen(pose.covariance, values, vectors);
  double sum = 0;
  for (int i = 0; i < freedom; ++i) {
    const double along = (vectors * all)[i];
    sum += along * along / values[i];
  }
  return sum;
}

TEST(RelativePose, FindsRotationAndDirectionThroughEveryLens) {
  for (const CameraModel& camera : {pinhole(), euroc(), fisheye()}) {
    Random random;
    const Scene scene(points_in_space(120, random), camera, usual_motion(), 0, random);
    const RelativePose pose = estimate(scene.request());
    EXPECT_EQ(pose.status, PoseStatus::measured);
    EXPECT_EQ(pose.known, PoseKnown::direction);
    EXPECT_EQ(pose.scale, ScaleStatus::not_asked);
    EXPECT_LT(rotation_error_deg(pose.T_match_query, scene.T_match_query), 0.001);
    EXPECT_LT(direction_error_deg(pose.T_match_query, scene.T_match_query), 0.01);
    EXPECT_NEAR(cv::norm(translation_of(pose.T_match_query)), 1, 1e-9);
    EXPECT_LT(pose.rms_px, 0.01);
  }
}

TEST(RelativePose, WithstandsWrongMatches) {
  Random random;
  Scene scene(points_in_space(150, random), pinhole(), usual_motion(), 1, random);
  for (std::size_t i = 0; i < 60; ++i) scene.matches[i].place = random.between(0, 149);
  const RelativePose pose = estimate(scene.request());
  EXPECT_EQ(pose.status, PoseStatus::measured);
  EXPECT_EQ(pose.matches, 150);
  EXPECT_GE(pose.inliers.size(), 80U);
  EXPECT_LE(pose.inliers.size(), 110U);
  EXPECT_LT(rotation_error_deg(pose.T_match_query, scene.T_match_query), 0.5);
  EXPECT_LT(direction_error_deg(pose.T_match_query, scene.T_match_query), 4);
}

TEST(RelativePose, IsMetricWithDepth) {
  Random random;
  const Scene scene(points_in_space(120, random), euroc(), usual_motion(), 0.5, random);
  const cv::Mat1f depth_m = depth_image(scene);
  PoseRequest request = scene.request();
  request.match_depth_m = &depth_m;
  const RelativePose pose = estimate(request);
  EXPECT_EQ(pose.known, PoseKnown::metric);
  EXPECT_EQ(pose.scale, ScaleStatus::known);
  EXPECT_GE(pose.points, 60);
  EXPECT_LT(cv::norm(translation_of(pose.T_match_query) - translation_of(scene.T_match_query)),
            0.05);
  EXPECT_LT(rotation_error_deg(pose.T_match_query, scene.T_match_query), 0.3);
}

/// Each feature has a descriptor of its own.
void describe(Features& features, Random& random) {
  features.num_dark = features.keypoints.size();
  for (std::size_t i = 0; i < features.keypoints.size(); ++i) {
    Descriptor descriptor{};
    for (auto& value : descriptor) value = static_cast<std::int8_t>(random.between(-60, 60));
    features.descriptors.push_back(descriptor);
  }
}

/// A view beside the match, with the features of the match.
Features view_beside(Scene& scene, const cv::Matx44d& T_match_view, Random& random) {
  describe(scene.match, random);
  Features view = features_of(scene.camera, T_match_view.inv(), scene.points, 0.5, random);
  view.descriptors = scene.match.descriptors;
  view.num_dark = scene.match.num_dark;
  return view;
}

TEST(RelativePose, IsMetricWithABaseline) {
  Random random;
  Scene scene(points_in_space(120, random), pinhole(), usual_motion(), 0.5, random);
  const cv::Matx44d T_match_view = transform({0, 0.02, 0}, {0.4, 0, 0.1});
  const Features view = view_beside(scene, T_match_view, random);
  const std::vector<NearbyView> beside{{{&view, &scene.camera}, T_match_view}};
  PoseRequest request = scene.request();
  request.beside = beside;
  const RelativePose pose = estimate(request);
  EXPECT_EQ(pose.known, PoseKnown::metric);
  EXPECT_LT(cv::norm(translation_of(pose.T_match_query) - translation_of(scene.T_match_query)),
            0.06);
}

TEST(RelativePose, NamesWhyTheLengthIsUnknown) {
  Random random;
  Scene scene(points_in_space(120, random), pinhole(), usual_motion(), 0.5, random);
  PoseRequest request = scene.request();
  const cv::Mat1f missing;
  request.match_depth_m = &missing;
  EXPECT_EQ(estimate(request).scale, ScaleStatus::no_depth);
  const cv::Mat1f holes(48, 64, 0.0F);  // of another size, which is permitted
  request.match_depth_m = &holes;
  EXPECT_EQ(estimate(request).scale, ScaleStatus::few_points);
  EXPECT_EQ(estimate(request).known, PoseKnown::direction);

  const Features view = view_beside(scene, cv::Matx44d::eye(), random);
  std::vector<NearbyView> beside{{{&view, &scene.camera}, cv::Matx44d::eye()}};
  request.beside = beside;
  EXPECT_EQ(estimate(request).scale, ScaleStatus::no_baseline);
  beside[0].T_match_view(0, 0) = std::nan("");
  expect_error(ErrorKind::input, {"T_match_view", "rigid"}, [&] { estimate(request); });
}

TEST(RelativePose, NamesDegenerateCases) {
  Random random;
  const auto status = [&](const std::vector<cv::Vec3d>& points, const cv::Matx44d& motion) {
    return estimate(Scene(points, pinhole(), motion, 1, random).request());
  };
  const auto points = points_in_space(120, random);
  const RelativePose turned = status(points, transform({0.05, 0.2, 0}, {0, 0, 0}));
  EXPECT_EQ(turned.status, PoseStatus::pure_rotation);
  EXPECT_EQ(turned.known, PoseKnown::rotation);
  EXPECT_EQ(cv::norm(translation_of(turned.T_match_query)), 0);
  EXPECT_LT(rotation_error_deg(turned.T_match_query, transform({0.05, 0.2, 0}, {})), 0.1);

  auto wall = points;
  for (cv::Vec3d& point : wall) point *= 8 / (point[2] + 0.4 * point[0]);
  const RelativePose flat = status(wall, transform({0, 0.1, 0}, {1.2, 0.1, 0.8}));
  EXPECT_EQ(flat.status, PoseStatus::plane);
  EXPECT_EQ(flat.known, PoseKnown::nothing);

  EXPECT_EQ(status(points_in_space(9, random), usual_motion()).status, PoseStatus::few_matches);

  Scene chance(points, pinhole(), usual_motion(), 1, random);
  for (Match& match : chance.matches) match.place = random.between(0, 119);
  EXPECT_EQ(estimate(chance.request()).status, PoseStatus::no_geometry);
}

TEST(RelativePose, OnlyDepthMeasuresAPlane) {
  Random random;
  auto wall = points_in_space(120, random);
  for (cv::Vec3d& point : wall) point *= 8 / (point[2] + 0.4 * point[0]);
  const Scene scene(wall, pinhole(), transform({0, 0.1, 0}, {1.2, 0.1, 0.8}), 0.5, random);
  const cv::Mat1f depth_m = depth_image(scene);
  PoseRequest request = scene.request();
  request.match_depth_m = &depth_m;
  const RelativePose pose = estimate(request);
  EXPECT_EQ(pose.status, PoseStatus::measured);
  EXPECT_EQ(pose.known, PoseKnown::metric);
  EXPECT_LT(cv::norm(translation_of(pose.T_match_query) - translation_of(scene.T_match_query)),
            0.2);
}

/// It is the mean of two estimates, increased for what few halves leave unknown.
TEST(RelativePose, CovarianceCoversTheErrors) {
  constexpr int kScenes = 150;
  Random random;
  double direction = 0;
  double metric = 0;
  for (int i = 0; i < kScenes; ++i) {
    const Scene scene(points_in_space(120, random), pinhole(), usual_motion(), 1, random);
    const RelativePose monocular = estimate(scene.request());
    ASSERT_EQ(monocular.known, PoseKnown::direction) << i;
    direction += nees(monocular, scene.T_match_query, 5) / 5 / kScenes;
    const cv::Mat1f depth_m = depth_image(scene);
    PoseRequest request = scene.request();
    request.match_depth_m = &depth_m;
    const RelativePose whole = estimate(request);
    ASSERT_EQ(whole.known, PoseKnown::metric) << i;
    metric += nees(whole, scene.T_match_query, 6) / 6 / kScenes;
  }
  EXPECT_GT(direction, 0.4);
  EXPECT_LT(direction, 1.0);
  EXPECT_GT(metric, 0.4);
  EXPECT_LT(metric, 1.0);
}

TEST(RelativePose, ResidualsHaveTheirJacobians) {
  Random random;
  const Scene scene(points_in_space(30, random), pinhole(), usual_motion(), 0, random);
  const RigidPose pose{scene.T_match_query.get_minor<3, 3>(0, 0),
                       translation_of(scene.T_match_query)};
  for (int i = 0; i < 30; ++i) {
    RayPair pair{.query = *ray_of({&scene.query, &scene.camera}, i),
                 .match = *ray_of({&scene.match, &scene.camera}, i)};
    pair.inverse_depth = 1 / cv::norm(scene.points[static_cast<std::size_t>(i)]);
    pair.inverse_depth_sigma = 0.02 * pair.inverse_depth;
    const Residual at = residual_of(pair, pose, FitKind::metric);
    ASSERT_EQ(at.size, 2);
    constexpr double kStep = 1e-5;
    for (int k = 0; k < 6; ++k) {
      cv::Vec6d step;
      step[k] = kStep;
      const RigidPose next{pose.rotation * rotation_by({step[3], step[4], step[5]}),
                           pose.translation + pose.rotation * cv::Vec3d(step[0], step[1], step[2])};
      const cv::Vec2d slope = (residual_of(pair, next, FitKind::metric).value - at.value) / kStep;
      // The weights move with the pose, too, which matters only for large residuals.
      for (int row = 0; row < 2; ++row) {
        EXPECT_NEAR(at.jacobian(row, k), slope[row], 0.5 + 0.01 * std::abs(slope[row]));
      }
    }
  }
}

/// Also of a large one near the epipole, whose standard deviation changes with the pose.
TEST(RelativePose, EpipolarResidualsHaveTheirJacobians) {
  Random random;
  const Scene scene(points_in_space(30, random), pinhole(), usual_motion(), 1, random);
  const RigidPose pose{scene.T_match_query.get_minor<3, 3>(0, 0) * rotation_by({0.02, 0.03, 0.01}),
                       cv::normalize(translation_of(scene.T_match_query))};
  for (int i = 0; i < 30; ++i) {
    const RayPair pair{.query = *ray_of({&scene.query, &scene.camera}, i),
                       .match = *ray_of({&scene.match, &scene.camera}, i)};
    const Residual at = residual_of(pair, pose, FitKind::direction);
    ASSERT_EQ(at.size, 1);
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 6; ++k) {
      cv::Vec6d step;
      step[k] = kStep;
      const RigidPose next{pose.rotation * rotation_by({step[3], step[4], step[5]}),
                           pose.translation + pose.rotation * cv::Vec3d(step[0], step[1], step[2])};
      const double slope =
          (residual_of(pair, next, FitKind::direction).value[0] - at.value[0]) / kStep;
      EXPECT_NEAR(at.jacobian(0, k), slope, 0.05 + 0.001 * std::abs(slope));
    }
  }
}

/// The first `count` pairs of a scene, and a pose beside the true one.
std::vector<RayPair> some_pairs(const Scene& scene, int count) {
  std::vector<RayPair> pairs;
  for (int i = 0; i < count; ++i) {
    pairs.push_back({.query = *ray_of({&scene.query, &scene.camera}, i),
                     .match = *ray_of({&scene.match, &scene.camera}, i)});
  }
  return pairs;
}

constexpr float kOutlier = 0.03F;

struct PlainSums {
  cv::Matx66d squares = cv::Matx66d::zeros();
  cv::Vec6d gradient;
  double likelihood = 1;
};

PlainSums sums_by_kernel(InstructionSet set, const DirectionPose& pose,
                         const std::vector<RayPair>& pairs) {
  DirectionSums found;
  kernels_for<DirectionKernels>(set).sum_up(pose, RayBlocks(pairs).arrays(), kOutlier, found);
  PlainSums sums;
  std::size_t entry = 0;
  for (int a = 0; a < 6; ++a) {
    sums.gradient[a] = static_cast<double>(found.gradient[a]);
    for (int b = 0; b <= a; ++b, ++entry) {
      sums.squares(a, b) = static_cast<double>(found.squares[entry]);
    }
  }
  for (const double likelihood : found.likelihoods) sums.likelihood *= likelihood;
  return sums;
}

/// Student's t distribution of 3 degrees of freedom, and outliers.
PlainSums slow_sums(const RigidPose& pose, const std::vector<RayPair>& pairs) {
  PlainSums sums;
  for (const RayPair& pair : pairs) {
    const Residual residual = residual_of(pair, pose, FitKind::direction);
    const double inlier = std::pow(1 + residual.norm_sq() / 3, -2);
    const double total = inlier + static_cast<double>(kOutlier);
    const double weight = inlier / total * 4 / (3 + residual.norm_sq());
    sums.likelihood *= total / (1 + static_cast<double>(kOutlier));
    for (int a = 0; a < 6; ++a) {
      const double weighted = weight * residual.jacobian(0, a);
      sums.gradient[a] += weighted * residual.value[0];
      for (int b = 0; b <= a; ++b) sums.squares(a, b) += weighted * residual.jacobian(0, b);
    }
  }
  return sums;
}

TEST(RelativePose, EveryKernelAddsUpTheSlowEquations) {
  Random random;
  const Scene scene(points_in_space(100, random), fisheye(), usual_motion(), 1, random);
  const RigidPose pose{scene.T_match_query.get_minor<3, 3>(0, 0) * rotation_by({0.01, 0.01, 0}),
                       cv::normalize(translation_of(scene.T_match_query))};
  const DirectionPose of_kernel = direction_pose(pose);
  for (const int count : {1, 15, 16, 17, 100}) {
    const auto pairs = some_pairs(scene, count);
    const PlainSums slow = slow_sums(pose, pairs);
    const PlainSums scalar = sums_by_kernel(InstructionSet::scalar, of_kernel, pairs);
    EXPECT_LT(cv::norm(scalar.squares - slow.squares), 1e-3 * cv::norm(slow.squares)) << count;
    EXPECT_LT(cv::norm(scalar.gradient - slow.gradient), 1e-3 * cv::norm(slow.gradient)) << count;
    EXPECT_NEAR(std::log(scalar.likelihood), std::log(slow.likelihood), 1e-3 * count) << count;
    for (const InstructionSet set : available_instruction_sets()) {
      const PlainSums sums = sums_by_kernel(set, of_kernel, pairs);
      EXPECT_EQ(cv::norm(sums.squares - scalar.squares), 0) << to_string(set);
      EXPECT_EQ(cv::norm(sums.gradient - scalar.gradient), 0) << to_string(set);
      EXPECT_EQ(sums.likelihood, scalar.likelihood) << to_string(set);
    }
  }
}

TEST(RelativePose, EveryKernelMeasuresTheSlowErrors) {
  Random random;
  const Scene scene(points_in_space(100, random), fisheye(), usual_motion(), 1, random);
  const RigidPose pose{scene.T_match_query.get_minor<3, 3>(0, 0),
                       cv::normalize(translation_of(scene.T_match_query))};
  for (const int count : {1, 16, 17, 100}) {
    const auto pairs = some_pairs(scene, count);
    const RayBlocks blocks(pairs);
    std::vector<float> scalar(blocks.arrays().stride);
    const DirectionPose of_kernel = direction_pose(pose);
    kernels_for<DirectionKernels>(InstructionSet::scalar)
        .errors_sq(of_kernel, blocks.arrays(), scalar.data());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double slow = epipolar_error_sq(pairs[i], essential_matrix(pose));
      EXPECT_NEAR(scalar[i], slow, 1e-3 * (1 + slow));
    }
    for (const InstructionSet set : available_instruction_sets()) {
      std::vector<float> errors_sq(scalar.size());
      kernels_for<DirectionKernels>(set).errors_sq(of_kernel, blocks.arrays(), errors_sq.data());
      EXPECT_EQ(errors_sq, scalar) << to_string(set);
    }
  }
}

/// Few noisy matches, a third of them wrong, have several minima of about the same cost.
TEST(RelativePose, RivalsCountInTheCovariance) {
  constexpr int kScenes = 150;
  Random random;
  int measured = 0;
  double sum = 0;
  for (int i = 0; i < kScenes; ++i) {
    Scene scene(points_in_space(45, random), pinhole(), usual_motion(), 1.5, random);
    for (std::size_t k = 0; k < 15; ++k) scene.matches[k].place = random.between(0, 44);
    const RelativePose pose = estimate(scene.request());
    if (pose.known != PoseKnown::direction) continue;
    ++measured;
    sum += nees(pose, scene.T_match_query, 5) / 5;
  }
  EXPECT_GT(measured, kScenes / 3);
  EXPECT_LT(sum / measured, 1.2);
}

TEST(RelativePose, InformationIsThatOfG2o) {
  RelativePose pose;
  EXPECT_EQ(cv::norm(g2o_information(pose)), 0);
  pose.covariance = cv::Matx66d::eye() * 0.04;
  pose.known = PoseKnown::metric;
  const cv::Matx66d metric = g2o_information(pose);
  EXPECT_NEAR(metric(0, 0), 25, 1e-9);
  EXPECT_NEAR(metric(5, 5), 100, 1e-9);  // of half an angle
  pose.known = PoseKnown::direction;
  const cv::Matx66d direction = g2o_information(pose);
  EXPECT_EQ(direction(0, 0), 0);
  EXPECT_NEAR(direction(3, 3), 100, 1e-9);
}

TEST(RelativePose, WritesEdgesOfG2o) {
  RelativePose pose;
  pose.known = PoseKnown::metric;
  pose.T_match_query = transform({0, 0, std::numbers::pi / 2}, {1, 2, -3});
  pose.covariance = cv::Matx66d::eye() * 0.25;
  EXPECT_TRUE(to_tum_pose(pose).starts_with("1 2 -3 0 0 0.70710678"));
  const std::string edge = to_g2o_edge(pose, 4, 9);
  EXPECT_TRUE(edge.starts_with("EDGE_SE3:QUAT 4 9 1 2 -3 0 0 0.70710678")) << edge;
  EXPECT_TRUE(edge.ends_with(" 4 0 0 0 0 0 4 0 0 0 0 4 0 0 0 16 0 0 16 0 16")) << edge;
}

TEST(RelativePose, ReadsDepthInMetres) {
  EXPECT_FLOAT_EQ(depth_in_metres(cv::Mat(2, 2, CV_16UC1, cv::Scalar(10000)))(1, 1), 2.0F);
  EXPECT_FLOAT_EQ(depth_in_metres(cv::Mat(2, 2, CV_16UC1, cv::Scalar(1500)), 1000)(0, 1), 1.5F);
  EXPECT_FLOAT_EQ(depth_in_metres(cv::Mat(2, 2, CV_32FC1, cv::Scalar(3)))(0, 0), 3.0F);
  expect_error(ErrorKind::input, {"3 channels"},
               [] { depth_in_metres(cv::Mat(2, 2, CV_8UC3, cv::Scalar())); });
}

/// Three pairs of KITTI's rectified cameras: no rotation, and the live one is 0.54 m to the left.
TEST(RelativePose, RealStereoPairs) {
  LOOPBIT_NEEDS_DATA("kitti00_stereo");
  const CameraModel camera{
      .size_px = {1241, 376}, .fx = 718.856, .fy = 718.856, .cx = 607.1928, .cy = 185.2157};
  for (const char* name : {"000000", "001000", "002000"}) {
    const auto features = [&](const std::string& which) {
      return extract_surf(real_image("kitti00_stereo/" + std::string(name) + which));
    };
    const Features right = features("_memory.png");
    const Features left = features("_live.png");
    const RelativePose pose =
        estimate({.query = {&left, &camera}, .match = {&right, &camera}, .matches = {}});
    EXPECT_EQ(pose.known, PoseKnown::direction) << name << ' ' << pose.status;
    const cv::Matx44d truth = transform({0, 0, 0}, {-0.54, 0, 0});
    EXPECT_LT(rotation_error_deg(pose.T_match_query, truth), 0.5) << name;
    EXPECT_LT(direction_error_deg(pose.T_match_query, truth), 5) << name;
  }
}

}  // namespace
}  // namespace test
}  // namespace loopbit
