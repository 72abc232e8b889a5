// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/camera.hpp"
#include "loopbit/known_motion.hpp"
#include "loopbit/options.hpp"
#include "loopbit/surf.hpp"
#include "loopbit/verification.hpp"

namespace loopbit {

/// The outcome of the estimate of a relative pose.
enum class PoseStatus {
  measured,         ///< `known` says how much
  few_matches,      ///< too few matches for any geometry
  no_geometry,      ///< no pose explains enough of the matches
  pure_rotation,    ///< the camera only turned, as far as the images show: rotation alone is known
  little_parallax,  ///< too little parallax for a direction: rotation alone is known
  plane,            ///< the points lie on a plane, and two poses may be right: nothing is known
  ambiguous,        ///< poses far apart may be right: nothing is known
};

inline constexpr std::array kAllPoseStatuses{PoseStatus::measured,        PoseStatus::few_matches,
                                             PoseStatus::no_geometry,     PoseStatus::pure_rotation,
                                             PoseStatus::little_parallax, PoseStatus::plane,
                                             PoseStatus::ambiguous};

/// The outcome of the search for the length of the translation.
enum class ScaleStatus {
  not_asked,  ///< neither depth nor a baseline was given
  known,
  no_depth,     ///< the match has no depth image and no views beside, or it is empty
  no_baseline,  ///< the views beside the match were taken from the same point
  few_points,   ///< too few matches have a depth, or their depths are too uncertain
};

inline constexpr std::array kAllScaleStatuses{ScaleStatus::not_asked, ScaleStatus::known,
                                              ScaleStatus::no_depth, ScaleStatus::no_baseline,
                                              ScaleStatus::few_points};

/// The enumerators' names.
std::string_view to_string(PoseStatus status);
std::string_view to_string(ScaleStatus status);

struct RelativePoseOptions {
  double max_ratio = 0.85;
  int min_inliers = 15;
  double max_error_px = 2.0;
  double max_direction_deg = 10.0;
  double max_position_share = 0.1;
  double depth_error_share = 0.01;

  static constexpr auto fields() {
    using S = RelativePoseOptions;
    return std::tuple{
        Field{"max_ratio", &S::max_ratio, 0.1, 1.0,
              "a match is used if its distance is below this share of the second-best distance"},
        Field{"min_inliers", &S::min_inliers, 8, 10'000, "smallest number of inliers of a pose"},
        Field{"max_error_px", &S::max_error_px, 0.1, 50.0,
              "largest distance of an inlier from the geometry, working pixels"},
        Field{"max_direction_deg", &S::max_direction_deg, 0.1, 90.0,
              "a direction with a larger standard deviation is not reported, degrees"},
        Field{"max_position_share", &S::max_position_share, 0.001, 10.0,
              "a metric translation with a larger standard deviation is not reported; share of the "
              "median distance of the points"},
        Field{"depth_error_share", &S::depth_error_share, 0.0001, 1.0,
              "standard deviation of a depth image, as a share of the depth"}};
  }
};

/// An image as its features and the camera that took it. Both must outlive the call.
struct PoseView {
  const Features* features = nullptr;
  const CameraModel* camera = nullptr;
};

/// A view whose pose relative to the match is known: the other camera of a stereo pair, or a frame
/// just before or after the match, by odometry.
struct NearbyView {
  PoseView view;
  cv::Matx44d T_match_view;  ///< from the view's camera frame to that of the match, in metres
};

/// What to estimate a relative pose from.
struct PoseRequest {
  PoseView query;
  PoseView match;
  /// Feature matches of the two. If empty, they are found, which takes most of the time.
  std::span<const Match> matches = {};
  /// Metres along z for each pixel of the match's image (of any resolution); 0 or NaN = unknown.
  const cv::Mat1f* match_depth_m = nullptr;
  /// Views with a baseline to the match. Used in place of a depth image.
  std::span<const NearbyView> beside = {};
};

/// The pose of the query's camera in the frame of the match's camera.
struct RelativePose {
  PoseStatus status = PoseStatus::few_matches;
  PoseKnown known = PoseKnown::nothing;
  ScaleStatus scale = ScaleStatus::not_asked;

  /// x_match = T_match_query x_query. In metres if `known` is metric. The translation has length 1
  /// if only its direction is known, and is 0 below that.
  cv::Matx44d T_match_query = cv::Matx44d::eye();
  /// Of a small motion (x, y, z, rx, ry, rz) in the frame of the *query's camera*, in metres and
  /// radians: T_true = T_match_query * [Exp(r) | p]. If only the direction is known, p is in units
  /// of the unknown length, and the covariance has rank 5: no part lies along the translation. If
  /// only the rotation is known, the part of p is 0.
  cv::Matx66d covariance = cv::Matx66d::zeros();

  int matches = 0;
  std::vector<Match> inliers;  ///< matches that the pose explains
  int points = 0;              ///< inliers whose depth is known
  double rms_px = 0;           ///< of the inliers' residuals, in pixels of the working image
};

/// Estimates relative poses. It keeps its working memory. Not thread-safe; use one per thread.
///
/// Rays take the place of pixels, so that every lens works. RANSAC on all matches (see
/// epipolar_inliers()) is followed by a search for the likeliest pose from many starting points,
/// each residual weighted by the noise of its two keypoints. Other minima count in the covariance
/// by the chance that they are right. With depths, each inlier with a depth adds a second equation,
/// and the translation gets a length; SQPnP is a second starting point. The same input gives the
/// same pose. Cost: 1 to 5 ms after the matches, see scripts/bench_poses.
class RelativePoseEstimator {
 public:
  /// Throws Error (kind option) if `options` are not valid.
  explicit RelativePoseEstimator(const RelativePoseOptions& options = {});
  ~RelativePoseEstimator();
  RelativePoseEstimator(const RelativePoseEstimator&) = delete;
  RelativePoseEstimator& operator=(const RelativePoseEstimator&) = delete;
  RelativePoseEstimator(RelativePoseEstimator&&) noexcept;
  RelativePoseEstimator& operator=(RelativePoseEstimator&&) noexcept;

  /// Throws Error (kind input) if a pose in `request.beside` is not finite or not rigid.
  RelativePose estimate(const PoseRequest& request);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

inline constexpr double kTumDepthUnitsPerM = 5000;

/// Metres for each pixel of a depth image as data sets store it: 16-bit integers in units of
/// 1 / `units_per_m` (5000 for TUM RGB-D, 1000 for most sensors), or floats in metres. 0 stays 0.
/// Throws Error (kind input) for another type.
cv::Mat1f depth_in_metres(const cv::Mat& depth, double units_per_m = kTumDepthUnitsPerM);

/// What is known of the pose, as a motion from the match to the query.
KnownMotion known_motion(const RelativePose& pose);

/// The functions of known_motion.hpp for what is known of a pose.
cv::Matx66d g2o_information(const RelativePose& pose);
std::string to_g2o_edge(const RelativePose& pose, int match, int query);
std::string to_tum_pose(const RelativePose& pose);

}  // namespace loopbit
