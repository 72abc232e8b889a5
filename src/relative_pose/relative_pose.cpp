// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/relative_pose.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>

#include "loopbit/error.hpp"
#include "loopbit/median.hpp"
#include "loopbit/ray_geometry.hpp"

#include "essential_search.hpp"
#include "point_depths.hpp"
#include "pose_fit.hpp"

namespace loopbit {
namespace {

/// Of keypoints; see keypoint_sigma_px().
constexpr double kUsualSigma_px = 0.5;
constexpr int kMinPoints = 8;
/// A pose with a cost below this multiple of the best one explains the pairs about as well.
constexpr double kMaxWorse = 1.2;

std::vector<RayPair> ray_pairs(const PoseRequest& request, std::span<const Match> matches) {
  std::vector<RayPair> pairs;
  pairs.reserve(matches.size());
  for (const Match& match : matches) {
    const auto query = ray_of(request.query, match.query);
    const auto place = ray_of(request.match, match.place);
    if (query && place) pairs.push_back({.query = *query, .match = *place, .features = match});
  }
  return pairs;
}

/// The pairs within `gate` standard deviations of `pose`.
std::vector<RayPair> inliers_of(std::span<const RayPair> pairs, const RigidPose& pose, FitKind kind,
                                double gate) {
  std::vector<RayPair> inliers;
  for (const RayPair& pair : pairs) {
    const Residual residual = residual_of(pair, pose, kind);
    if (residual.size > 0 && residual.norm_sq() <= gate * gate) inliers.push_back(pair);
  }
  return inliers;
}

/// The standard deviation of the residuals, in units of the one that was assumed.
double residual_scale(std::span<const RayPair> inliers, const RigidPose& pose, FitKind kind) {
  double sum = 0;
  int equations = 0;
  for (const RayPair& pair : inliers) {
    const Residual residual = residual_of(pair, pose, kind);
    sum += residual.norm_sq();
    equations += residual.size;
  }
  const int unknown = kind == FitKind::rotation ? 3 : kind == FitKind::direction ? 5 : 6;
  return std::sqrt(sum / std::max(1, equations - unknown));
}

cv::Matx44d matrix_of(const RigidPose& pose) {
  const cv::Matx33d& r = pose.rotation;
  const cv::Vec3d& t = pose.translation;
  return {r(0, 0), r(0, 1), r(0, 2), t[0], r(1, 0), r(1, 1), r(1, 2), t[1],
          r(2, 0), r(2, 1), r(2, 2), t[2], 0,       0,       0,       1};
}

/// The largest standard deviation of the three numbers of a covariance from `first` on.
double largest_sigma(const cv::Matx66d& covariance, int first) {
  cv::Matx33d part;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      part(row, column) = covariance(first + row, first + column);
    }
  }
  cv::Vec3d values;
  cv::eigen(part, values);
  return std::sqrt(std::max(values[0], 0.0));
}

/// The length of the translation of `pose` at which the points with depths meet the query's rays:
/// the median, since some depths are wrong.
std::optional<double> length_m(std::span<const RayPair> pairs, const RigidPose& pose) {
  std::vector<double> lengths;
  const cv::Matx33d back = pose.rotation.t();
  for (const RayPair& pair : pairs) {
    if (!pair.has_depth()) continue;
    const cv::Vec3d at_rest = pair.query.direction.cross(back * pair.match.direction);
    const cv::Vec3d moved = pair.query.direction.cross(back * pose.translation);
    const double moved_sq = moved.dot(moved) * pair.inverse_depth;
    if (moved_sq > 0) lengths.push_back(at_rest.dot(moved) / moved_sq);
  }
  if (lengths.empty()) return std::nullopt;
  return std::max(median(std::move(lengths)), 0.0);
}

/// RANSAC on the points, and SQPnP of its inliers (Terzakis and Lourakis 2020).
std::optional<RigidPose> pose_of_points(std::span<const RayPair> pairs) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> seen;
  constexpr double kMinAhead = 0.1;
  for (const RayPair& pair : pairs) {
    const cv::Vec3d& q = pair.query.direction;
    if (!pair.has_depth() || q[2] < kMinAhead) continue;
    points.emplace_back(pair.match.direction / pair.inverse_depth);
    seen.emplace_back(q[0] / q[2], q[1] / q[2]);
  }
  if (static_cast<int>(points.size()) < kMinPoints) return std::nullopt;
  constexpr int kRounds = 100;
  constexpr float kMaxError = 0.01F;  // of a focal length: a start need not be exact
  constexpr double kConfidence = 0.99;
  cv::Vec3d turn;
  cv::Vec3d translation;
  if (!cv::solvePnPRansac(points, seen, cv::Matx33d::eye(), cv::noArray(), turn, translation, false,
                          kRounds, kMaxError, kConfidence, cv::noArray(), cv::SOLVEPNP_SQPNP)) {
    return std::nullopt;
  }
  const cv::Matx33d back = rotation_by(turn);  // from the match's frame to the query's
  return RigidPose{back.t(), -(back.t() * translation)};
}

/// Whether a fit in another minimum, its position apart by more than a small share of the distance
/// of the points, explains them about as well as `best`.
bool has_rival(std::span<const PoseFit> fits, const PoseFit& best, double distance_m) {
  constexpr double kApart = 0.02;
  return std::ranges::any_of(fits, [&](const PoseFit& fit) {
    return fit.cost < kMaxWorse * best.cost &&
           cv::norm(fit.pose.translation - best.pose.translation) > kApart * distance_m;
  });
}

}  // namespace

class RelativePoseEstimator::Impl {
 public:
  explicit Impl(const RelativePoseOptions& options)
      : options_(options), verifier_({.max_ratio = options.max_ratio}) {
    validate(options, "relative_pose");
  }

  RelativePose estimate(const PoseRequest& request) {
    RelativePose result;
    const bool is_length_asked = request.match_depth_m != nullptr || !request.beside.empty();
    if (is_length_asked) result.scale = ScaleStatus::few_points;  // until there is a geometry
    // Matches, as pairs of rays.
    if (request.matches.empty()) {
      verifier_.match(*request.query.features, *request.match.features, found_);
    } else {
      found_.matches.assign(request.matches.begin(), request.matches.end());
    }
    result.matches = static_cast<int>(found_.matches.size());
    pairs_ = ray_pairs(request, found_.matches);
    if (static_cast<int>(pairs_.size()) < options_.min_inliers) return result;
    // What the directions of the rays say.
    estimate_direction(result);
    if (result.status == PoseStatus::no_geometry) return result;
    // With depths, the length.
    if (is_length_asked) estimate_metric(request, result);
    if (result.known == PoseKnown::direction) check_parallax(result);
    return result;
  }

 private:
  [[nodiscard]] double gate() const { return options_.max_error_px / kUsualSigma_px; }

  /// All but the covariance, which takes as long as the rest.
  static void report(const PoseFit& fit, FitKind kind, std::span<const RayPair> inliers,
                     RelativePose& result) {
    const double scale = residual_scale(inliers, fit.pose, kind);
    result.T_match_query = matrix_of(fit.pose);
    result.rms_px = scale * kUsualSigma_px;
    result.inliers.clear();
    for (const RayPair& pair : inliers) result.inliers.push_back(pair.features);
  }

  /// Sets rotation and direction, and what is known of them.
  void estimate_direction(RelativePose& result) {
    result.status = PoseStatus::no_geometry;
    const auto found = search_direction(pairs_, gate());
    if (!found) return;
    const PoseFit& fit = found->best;
    inliers_ = inliers_of(pairs_, fit.pose, FitKind::direction, gate());
    if (static_cast<int>(inliers_.size()) < options_.min_inliers) return;
    starts_ = {fit.pose};
    direction_cost_ = fit.cost;
    if (!found->rivals.empty()) starts_.push_back(found->rivals.front().pose);
    report(fit, FitKind::direction, inliers_, result);
    direction_ = fit.pose;
    result.status = PoseStatus::measured;
    result.known = PoseKnown::direction;
    name_degenerate_case(*found, result);
  }

  /// Whether a turn alone explains nearly all inliers. If so, sets the rotation.
  bool is_pure_rotation(RelativePose& result) {
    constexpr double kMinShare = 0.9;
    constexpr double kMaxError = 3;  // standard deviations
    const auto share_of = [&](std::span<const RayPair> turned) {
      return static_cast<double>(turned.size()) / static_cast<double>(inliers_.size());
    };
    const RigidPose start{rotation_between(inliers_), {}};
    if (share_of(inliers_of(inliers_, start, FitKind::rotation, gate())) < 0.5) return false;
    const PoseFit turn = fit_pose(inliers_, start, FitKind::rotation, gate());
    const auto turned = inliers_of(inliers_, turn.pose, FitKind::rotation, kMaxError);
    if (share_of(turned) <= kMinShare) return false;
    starts_ = {turn.pose};
    report(turn, FitKind::rotation, turned, result);
    result.covariance = covariance_of(turned, turn.pose, FitKind::rotation, gate());
    result.status = PoseStatus::pure_rotation;
    result.known = PoseKnown::rotation;
    return true;
  }

  void name_degenerate_case(const DirectionSearch& found, RelativePose& result) {
    if (is_pure_rotation(result)) return;
    // Others that explain the pairs about as well.
    std::vector<PoseFit> rivals = found.rivals;
    const auto other = rival_of_plane(inliers_, found.best, gate());
    const auto rivalry = [&](std::span<const PoseFit> of) {
      return rivalry_of(pairs_, direction_, of, gate());
    };
    if (other && is_unsure(rivalry({&*other, 1}))) {
      starts_.push_back(other->pose);
      result.status = PoseStatus::plane;
      result.known = PoseKnown::nothing;
      return;
    }
    if (other) rivals.push_back(*other);
    rivalry_ = rivalry(rivals);
    if (!is_unsure(rivalry_)) return;
    result.status = PoseStatus::ambiguous;
    result.known = PoseKnown::nothing;
  }

  /// Whether a direction with this covariance is not reported.
  [[nodiscard]] bool is_unsure(const cv::Matx66d& covariance) const {
    constexpr double kDegrees = 180 / std::numbers::pi;
    return largest_sigma(covariance, 0) * kDegrees > options_.max_direction_deg;
  }

  /// Sets the covariance of a direction, and whether it is known at all. Not again for one that has
  /// a covariance.
  void check_parallax(RelativePose& result) const {
    if (result.covariance != cv::Matx66d::zeros()) return;
    result.covariance = covariance_of(inliers_, direction_, FitKind::direction, gate()) + rivalry_;
    if (is_unsure(result.covariance)) {
      result.status = PoseStatus::little_parallax;
      result.known = PoseKnown::rotation;
      forget_translation(result);
    }
  }

  static void forget_translation(RelativePose& result) {
    for (int row = 0; row < 3; ++row) {
      result.T_match_query(row, 3) = 0;
      for (int i = 0; i < 6; ++i) {
        result.covariance(row, i) = 0;
        result.covariance(i, row) = 0;
      }
    }
  }

  void estimate_metric(const PoseRequest& request, RelativePose& result) {
    if (request.beside.empty()) {
      result.scale = ScaleStatus::no_depth;
      if (request.match_depth_m->empty()) return;
      set_depths(request.match, *request.match_depth_m, options_.depth_error_share, pairs_);
    } else {
      constexpr double kMinBaseline_m = 1e-6;
      result.scale = ScaleStatus::no_baseline;
      const bool has_baseline = longest_baseline_m(request.beside) > kMinBaseline_m;
      triangulate(request.match, request.beside, gate(), verifier_, pairs_);
      if (!has_baseline) return;
    }
    result.scale = ScaleStatus::few_points;
    const auto fit = fit_metric();
    if (!fit) return;
    const auto inliers = inliers_of(pairs_, fit->pose, FitKind::metric, gate());
    const auto points = std::ranges::count_if(inliers, &RayPair::has_depth);
    if (points < kMinPoints || static_cast<int>(inliers.size()) < options_.min_inliers) return;
    if (has_metric_rival_ || contradicts_directions(fit->pose, result)) {
      result.status = PoseStatus::ambiguous;
      result.known = PoseKnown::nothing;
      return;
    }
    RelativePose metric = result;
    report(*fit, FitKind::metric, inliers, metric);
    metric.covariance = covariance_of(inliers, fit->pose, FitKind::metric, gate());
    if (largest_sigma(metric.covariance, 0) > options_.max_position_share * distance_m(inliers)) {
      return;
    }
    result = metric;
    result.points = static_cast<int>(points);
    result.status = PoseStatus::measured;
    result.known = PoseKnown::metric;
    result.scale = ScaleStatus::known;
  }

  /// Whether a pose with a length explains the rays much worse than the best direction does: then
  /// the fit of the points stopped in a wrong minimum, or their depths are wrong. Without parallax
  /// there is no direction to compare with.
  [[nodiscard]] bool contradicts_directions(const RigidPose& pose, RelativePose& directions) const {
    if (directions.status == PoseStatus::pure_rotation) return false;
    const double cost = cost_of(RayBlocks(pairs_), pose, gate());
    if (cost <= kMaxWorse * direction_cost_) return false;
    if (directions.known == PoseKnown::direction) check_parallax(directions);
    return directions.status != PoseStatus::little_parallax;
  }

  static double distance_m(std::span<const RayPair> inliers) {
    std::vector<double> distances;
    for (const RayPair& pair : inliers) {
      if (pair.has_depth()) distances.push_back(1 / pair.inverse_depth);
    }
    return median(std::move(distances));
  }

  /// The best fit of several starting points, and whether it has a rival: the direction with a
  /// length, no translation at all, and the pose of the points alone.
  std::optional<PoseFit> fit_metric() {
    std::vector<RayPair> with_depth;
    std::ranges::copy_if(pairs_, std::back_inserter(with_depth), &RayPair::has_depth);
    if (static_cast<int>(with_depth.size()) < kMinPoints) return std::nullopt;
    std::vector<RigidPose> starts;
    for (const RigidPose& start : starts_) {
      starts.push_back({start.rotation, {}});
      const auto length = length_m(inliers_with_depth(), start);
      if (length) starts.push_back({start.rotation, start.translation * *length});
    }
    if (const auto pose = pose_of_points(with_depth)) starts.push_back(*pose);
    std::vector<PoseFit> fits;
    fits.reserve(starts.size());
    for (const RigidPose& start : starts) {
      fits.push_back(fit_pose(with_depth, start, FitKind::metric, gate()));
    }
    const PoseFit& best = *std::ranges::min_element(fits, {}, &PoseFit::cost);
    has_metric_rival_ = has_rival(fits, best, distance_m(with_depth));
    const PoseFit whole = fit_pose(pairs_, best.pose, FitKind::metric, gate());
    return whole;
  }

  /// The inliers of the direction, with the depths that were found since.
  [[nodiscard]] std::vector<RayPair> inliers_with_depth() const {
    std::vector<RayPair> result;
    for (const RayPair& pair : pairs_) {
      const bool is_inlier = std::ranges::any_of(
          inliers_, [&](const RayPair& inlier) { return inlier.features == pair.features; });
      if (is_inlier && pair.has_depth()) result.push_back(pair);
    }
    return result;
  }

  RelativePoseOptions options_;
  Verifier verifier_;
  Verification found_;
  std::vector<RayPair> pairs_;
  std::vector<RayPair> inliers_;  ///< of the direction
  bool has_metric_rival_ = false;
  RigidPose direction_;  ///< with a translation of length 1
  double direction_cost_ = 0;
  cv::Matx66d rivalry_;            ///< what other directions add to its covariance
  std::vector<RigidPose> starts_;  ///< what the directions say, best first
};

RelativePoseEstimator::RelativePoseEstimator(const RelativePoseOptions& options)
    : impl_(std::make_unique<Impl>(options)) {}
RelativePoseEstimator::~RelativePoseEstimator() = default;
RelativePoseEstimator::RelativePoseEstimator(RelativePoseEstimator&&) noexcept = default;
RelativePoseEstimator& RelativePoseEstimator::operator=(RelativePoseEstimator&&) noexcept = default;

RelativePose RelativePoseEstimator::estimate(const PoseRequest& request) {
  return impl_->estimate(request);
}

std::string_view to_string(PoseStatus status) {
  switch (status) {
    case PoseStatus::measured:
      return "measured";
    case PoseStatus::few_matches:
      return "few_matches";
    case PoseStatus::no_geometry:
      return "no_geometry";
    case PoseStatus::pure_rotation:
      return "pure_rotation";
    case PoseStatus::little_parallax:
      return "little_parallax";
    case PoseStatus::plane:
      return "plane";
    case PoseStatus::ambiguous:
      return "ambiguous";
  }
  return "";
}

std::string_view to_string(ScaleStatus status) {
  switch (status) {
    case ScaleStatus::not_asked:
      return "not_asked";
    case ScaleStatus::known:
      return "known";
    case ScaleStatus::no_depth:
      return "no_depth";
    case ScaleStatus::no_baseline:
      return "no_baseline";
    case ScaleStatus::few_points:
      return "few_points";
  }
  return "";
}

cv::Mat1f depth_in_metres(const cv::Mat& depth, double units_per_m) {
  cv::Mat1f depth_m;
  if (depth.type() == CV_16UC1) {
    if (!(units_per_m > 0)) {
      throw Error(ErrorKind::option, fmt::format("units_per_m is {}, but must be positive, such as "
                                                 "5000 for TUM RGB-D.",
                                                 units_per_m));
    }
    depth.convertTo(depth_m, CV_32F, 1 / units_per_m);
    return depth_m;
  }
  if (depth.type() == CV_32FC1 || depth.empty()) return depth;
  throw Error(ErrorKind::input, fmt::format("A depth image has {} channels and OpenCV's depth {}; "
                                            "give one channel of 16-bit integers or of floats.",
                                            depth.channels(), depth.depth()));
}

KnownMotion known_motion(const RelativePose& pose) {
  return {pose.known, {pose.T_match_query, pose.covariance}};
}

cv::Matx66d g2o_information(const RelativePose& pose) {
  return g2o_information(known_motion(pose));
}

std::string to_g2o_edge(const RelativePose& pose, int match, int query) {
  return to_g2o_edge(known_motion(pose), match, query);
}

std::string to_tum_pose(const RelativePose& pose) { return to_tum_pose(pose.T_match_query); }

}  // namespace loopbit
