// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/options.hpp"

namespace loopbit {

/// How fast odometry drifts: standard deviations of its errors. Errors keep their sign for
/// `correlated_m` and are independent beyond, so they grow with the distance at first, and with its
/// square root later.
struct OdometryDrift {
  double position_per_m = 0.01;
  double rotation_deg_per_m = 0.1;
  double rotation_per_rad = 0.02;
  double correlated_m = 10.0;

  static constexpr auto fields() {
    using S = OdometryDrift;
    return std::tuple{Field{"position_per_m", &S::position_per_m, 1e-5, 10.0,
                            "drift of the position per metre driven, m"},
                      Field{"rotation_deg_per_m", &S::rotation_deg_per_m, 1e-5, 90.0,
                            "drift of the rotation per metre driven, degrees"},
                      Field{"rotation_per_rad", &S::rotation_per_rad, 0.0, 10.0,
                            "drift of the rotation per radian turned, rad"},
                      Field{"correlated_m", &S::correlated_m, 0.01, 1000.0,
                            "errors keep their sign for this distance, m"}};
  }
};

/// What odometry says at one frame.
struct OdometryPose {
  /// x_odometry = T_odometry_camera x_camera, in metres: the pose of the *camera* (x right, y down,
  /// z forward) in any fixed frame. Only differences of poses are used.
  cv::Matx44d T_odometry_camera = cv::Matx44d::eye();
  /// Of the motion since the last frame with odometry, as in Motion. None = by OdometryDrift.
  std::optional<cv::Matx66d> covariance = std::nullopt;
};

/// A motion of a camera and its uncertainty.
struct Motion {
  /// x_from = T_from_to x_to, in metres.
  cv::Matx44d T_from_to = cv::Matx44d::eye();
  /// Of a small motion (x, y, z, rx, ry, rz) in the frame `to`, in metres and radians:
  /// T_true = T_from_to * [Exp(r) | p]. The convention of RelativePose.
  cv::Matx66d covariance = cv::Matx66d::zeros();
};

/// One motion after another. Their errors are independent.
Motion chained(const Motion& first, const Motion& second);

/// The covariance of one odometry step. It is never singular: 0.1 mm and 0.001 degrees remain when
/// the camera stands still.
cv::Matx66d drift_covariance(const cv::Matx44d& T_from_to, const OdometryDrift& drift);

/// The motion since the last frame with odometry, where its pose was `before`. The covariance is
/// that of `pose`; if it has none, that of `drift`.
Motion odometry_step(const cv::Matx44d& before, const OdometryPose& pose,
                     const OdometryDrift& drift);

/// Whether `pose` is finite and rigid (to 0.001), and its covariance, if there is one, is finite,
/// symmetric and positive definite.
bool is_valid(const OdometryPose& pose);

/// Throws Error (kind input) unless is_valid(pose). The message begins with `name`.
void check_odometry(const OdometryPose& pose, const std::string& name);

/// Odometry along a session, with the drift between any two of its frames. Memory: 450 bytes per
/// frame up to the last one with odometry.
class OdometryTrack {
 public:
  /// Throws Error (kind option) if `drift` is not valid.
  explicit OdometryTrack(const OdometryDrift& drift = {});

  /// A frame of the track.
  struct Frame {
    bool is_known = false;
    cv::Matx44d pose = cv::Matx44d::eye();
    double path_m = 0;
    cv::Matx66d drift = cv::Matx66d::zeros();  ///< sum over all steps, in the frame of odometry
  };

  /// What add() would add. Throws Error (kind input), see check_odometry().
  [[nodiscard]] Frame next(const std::optional<OdometryPose>& pose) const;

  /// Adds the next frame. None: its odometry is not known. Throws Error (kind input), see
  /// check_odometry(); the track is then unchanged.
  void add(const std::optional<OdometryPose>& pose);

  /// Takes the memory that the next add() needs, so that it only throws for a bad pose. `is_known`:
  /// the next frame has odometry.
  void reserve_next(bool is_known);

  /// The motion between two frames. None if odometry is not known at one of them. The covariance
  /// adds up the drift of all steps between them. Constant time.
  [[nodiscard]] std::optional<Motion> between(int from, int to) const;

  /// The same to a frame that next() gave.
  [[nodiscard]] std::optional<Motion> to_next(int from, const Frame& next) const;

  /// Whether odometry is known at `frame`.
  [[nodiscard]] bool is_known(int frame) const { return at(frame).is_known; }

  /// Distance driven until `frame`, in metres. At a frame without odometry, that of the last frame
  /// with it.
  [[nodiscard]] double path_m(int frame) const;

  /// Number of frames.
  [[nodiscard]] int size() const { return size_; }

 private:
  [[nodiscard]] const Frame& at(int frame) const;

  OdometryDrift drift_;
  int size_ = 0;
  std::vector<Frame> frames_;  ///< up to the last one with odometry
  Frame end_;                  ///< as all frames after it
};

}  // namespace loopbit
