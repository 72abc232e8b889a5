// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <numbers>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/rigid_motion.hpp"
#include "loopbit/world.hpp"

#include "chance.hpp"

namespace loopbit {
namespace {

constexpr OdometryDrift kWorldDrift{
    .position_per_m = 0.01, .rotation_deg_per_m = 0.1, .rotation_per_rad = 0, .correlated_m = 10};
constexpr double kTilt = 1e-3 * std::numbers::pi / 180;  // of one step
constexpr std::uint32_t kOdometrySalt = 0x0d03e7U;

/// Of mean 0 and standard deviation 1, about.
double normal(town::Random& random) {
  constexpr int kSummands = 12;
  double sum = -kSummands / 2.0;
  for (int i = 0; i < kSummands; ++i) sum += static_cast<double>(random.uniform());
  return sum;
}

/// The errors per metre of one stretch.
struct Errors {
  cv::Vec3d position;
  double heading_rad;
};

Errors errors_of(std::uint32_t seed, int stretch) {
  town::Random random(town::hash_of(seed ^ kOdometrySalt, stretch));
  Errors errors{};
  for (double& value : errors.position.val) value = kWorldDrift.position_per_m * normal(random);
  errors.heading_rad = kWorldDrift.rotation_deg_per_m * std::numbers::pi / 180 * normal(random);
  return errors;
}

/// A motion of the camera with its errors.
cv::Matx44d with_errors(const cv::Matx44d& step, const Errors& errors, double distance_m) {
  const auto [sin, cos] = town::sin_cos(errors.heading_rad * distance_m);
  const cv::Vec3d moved = errors.position * distance_m;
  return step *
         cv::Matx44d(cos, 0, sin, moved[0], 0, 1, 0, moved[1], -sin, 0, cos, moved[2], 0, 0, 0, 1);
}

}  // namespace

std::vector<OdometryPose> drifting_odometry(const World& world) {
  const auto seed = static_cast<std::uint32_t>(world.options().seed);
  std::vector<OdometryPose> odometry(1);
  double path_m = 0;
  for (int frame = 1; frame < world.options().frames; ++frame) {
    const cv::Matx44d step =
        rigid::inverse(world.T_world_camera(frame - 1)) * world.T_world_camera(frame);
    const double distance_m = cv::norm(rigid::translation(step));
    const int stretch = town::floor_int(path_m / kWorldDrift.correlated_m);
    const cv::Matx44d measured = with_errors(step, errors_of(seed, stretch), distance_m);
    cv::Matx66d covariance = drift_covariance(measured, kWorldDrift);
    covariance(3, 3) = covariance(5, 5) = kTilt * kTilt;
    odometry.push_back({odometry.back().T_odometry_camera * measured, covariance});
    path_m += distance_m;
  }
  return odometry;
}

}  // namespace loopbit
