// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "pose_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <opencv2/calib3d.hpp>

#include "loopbit/kernels_for.hpp"
#include "loopbit/ray_geometry.hpp"

#include "direction_kernels.hpp"

namespace loopbit {
namespace {

constexpr int kSplits = 8;

using Jacobian = cv::Matx<double, 2, 6>;

/// Two unit vectors across `direction` and each other, as rows.
cv::Matx23d across(const cv::Vec3d& direction) {
  const cv::Vec3d axis = std::abs(direction[0]) < 0.6 ? cv::Vec3d(1, 0, 0) : cv::Vec3d(0, 1, 0);
  const cv::Vec3d u = cv::normalize(direction.cross(axis));
  const cv::Vec3d v = direction.cross(u);
  return {u[0], u[1], u[2], v[0], v[1], v[2]};
}

/// A pose, and its inverse rotation and translation: what residuals need of it.
struct PoseFrame {
  explicit PoseFrame(const RigidPose& pose)
      : rotation(pose.rotation), back(pose.rotation.t()), translation(back * pose.translation) {}

  cv::Matx33d rotation;
  cv::Matx33d back;
  cv::Vec3d translation;  ///< in the frame of the query's camera
};

/// Products that the compiler keeps in registers, which it does not with those of cv::Matx.
cv::Vec3d times(const cv::Matx33d& a, const cv::Vec3d& v) {
  const double* m = a.val;
  return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
          m[6] * v[0] + m[7] * v[1] + m[8] * v[2]};
}

cv::Vec3d times(const cv::Matx32d& a, const cv::Vec2d& v) {
  const double* m = a.val;
  return {m[0] * v[0] + m[1] * v[1], m[2] * v[0] + m[3] * v[1], m[4] * v[0] + m[5] * v[1]};
}

cv::Vec3d transposed_times(const cv::Matx33d& a, const cv::Vec3d& v) {
  const double* m = a.val;
  return {m[0] * v[0] + m[3] * v[1] + m[6] * v[2], m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
          m[2] * v[0] + m[5] * v[1] + m[8] * v[2]};
}

cv::Vec2d transposed_times(const cv::Matx32d& a, const cv::Vec3d& v) {
  const double* m = a.val;
  return {m[0] * v[0] + m[2] * v[1] + m[4] * v[2], m[1] * v[0] + m[3] * v[1] + m[5] * v[2]};
}

/// match . (translation x rotation query) = 0, divided by its standard deviation. Near the epipole
/// that deviation depends strongly on the pose, so its derivative counts, too.
Residual epipolar_residual(const RayPair& pair, const PoseFrame& pose) {
  // All in the frame of the query's camera.
  const cv::Vec3d& q = pair.query.direction;
  const cv::Vec3d m = times(pose.back, pair.match.direction);
  const cv::Vec3d& t = pose.translation;
  const cv::Vec3d normal_of_query = t.cross(q);
  const cv::Vec3d normal_of_match = m.cross(t);
  // The noise of each keypoint across the other's epipolar line.
  const cv::Vec2d by_match =
      transposed_times(pair.match.spread, times(pose.rotation, normal_of_query));
  const cv::Vec2d by_query = transposed_times(pair.query.spread, normal_of_match);
  const double sigma = std::sqrt(by_match.dot(by_match) + by_query.dot(by_query));
  if (!(sigma > 0)) return {};
  const double scale = 1 / sigma;
  const double value = m.dot(normal_of_query) * scale;
  const cv::Vec3d match_pull = times(pose.back, times(pair.match.spread, by_match)) * scale;
  const cv::Vec3d query_pull = times(pair.query.spread, by_query) * scale;
  const cv::Vec3d sigma_by_translation = q.cross(match_pull) + query_pull.cross(m);
  const cv::Vec3d sigma_by_rotation =
      q.cross(match_pull.cross(t)) + query_pull.cross(normal_of_match);
  const cv::Vec3d by_translation = (q.cross(m) - value * sigma_by_translation) * scale;
  const cv::Vec3d by_rotation = (q.cross(normal_of_match) - value * sigma_by_rotation) * scale;
  Residual residual;
  residual.size = 1;
  residual.value = {value, 0};
  for (int i = 0; i < 3; ++i) {
    residual.jacobian(0, i) = by_translation[i];
    residual.jacobian(0, i + 3) = by_rotation[i];
  }
  return residual;
}

/// d direction / d `point`, on the `plane` across the ray that it is compared with.
cv::Matx23d direction_by_point(const cv::Matx23d& plane, const cv::Vec3d& point) {
  const double length = cv::norm(point);
  const cv::Vec3d direction = point / length;
  return (plane - (plane * direction) * direction.t()) * (1 / length);
}

/// The inverse of the Cholesky factor of a covariance.
cv::Matx22d whitening(const cv::Matx22d& covariance) {
  const double l00 = std::sqrt(covariance(0, 0));
  const double l10 = covariance(1, 0) / l00;
  const double l11 = std::sqrt(std::max(covariance(1, 1) - l10 * l10, 1e-30));
  return {1 / l00, 0, -l10 / (l00 * l11), 1 / l11};
}

/// Where the query sees the point at the pair's depth (at infinity, for rotation alone), across its
/// ray, divided by the standard deviations. These depend on the pose, too. So the derivative is
/// taken at the likeliest point, between the one that was measured and the query's ray (the
/// envelope theorem).
Residual point_residual(const RayPair& pair, const PoseFrame& pose) {
  const cv::Matx33d& back = pose.back;
  const cv::Vec3d& t = pose.translation;
  const cv::Vec3d m = back * pair.match.direction;
  const cv::Vec3d& q = pair.query.direction;
  Residual residual;
  const cv::Vec3d seen = m - pair.inverse_depth * t;
  const double length = cv::norm(seen);
  if (!(length > 0)) return residual;
  residual.size = 2;
  if (seen.dot(q) <= 0) {  // behind the camera: far from any inlier
    residual.value = {1e3, 1e3};
    return residual;
  }
  const cv::Matx23d plane = across(q);
  const cv::Matx23d by_seen = direction_by_point(plane, seen);
  const cv::Matx22d by_query = plane * pair.query.spread;
  const cv::Vec2d by_inverse_depth = by_seen * t * -1.0;
  const cv::Matx32d match_spread = back * pair.match.spread;
  const cv::Matx22d by_match =
      by_seen * match_spread + by_inverse_depth * pair.inverse_depth_by_match.t();
  const cv::Vec2d by_depth = by_inverse_depth * pair.inverse_depth_sigma;
  const cv::Matx22d whiten =
      whitening(by_query * by_query.t() + by_match * by_match.t() + by_depth * by_depth.t());
  const cv::Vec2d error = plane * (seen / length);
  residual.value = whiten * error;
  // The likeliest noise of the depth and of the match's keypoint.
  const cv::Vec2d pull = whiten.t() * residual.value;
  const cv::Vec2d of_match = by_match.t() * pull * -1.0;
  const double inverse_depth = pair.inverse_depth - pair.inverse_depth_sigma * by_depth.dot(pull) +
                               pair.inverse_depth_by_match.dot(of_match);
  const cv::Vec3d likely = m + match_spread * of_match - inverse_depth * t;
  const cv::Matx23d by_point = whiten * direction_by_point(plane, likely);
  const cv::Matx23d by_rotation = by_point * cross_matrix(likely);
  const cv::Matx23d by_translation = by_point * -inverse_depth;
  for (int row = 0; row < 2; ++row) {
    for (int i = 0; i < 3; ++i) {
      residual.jacobian(row, i) = by_translation(row, i);
      residual.jacobian(row, i + 3) = by_rotation(row, i);
    }
  }
  return residual;
}

/// Whether the residual of a pair is one equation, without a point.
bool is_epipolar(const RayPair& pair, FitKind kind) {
  return kind == FitKind::direction || (kind == FitKind::metric && !pair.has_depth());
}

Residual residual_of(const RayPair& pair, const PoseFrame& pose, FitKind kind) {
  return is_epipolar(pair, kind) ? epipolar_residual(pair, pose) : point_residual(pair, pose);
}

/// What residuals are drawn from: Student's t distribution of 3 degrees of freedom, the heaviest
/// tails that still have a variance, or outliers, spread evenly. At `gate` standard deviations both
/// are as likely.
class Noise {
 public:
  explicit Noise(double gate) : outlier_{density(gate * gate, 1), density(gate * gate, 2)} {}

  /// The derivative of half the cost by half the squared residual.
  [[nodiscard]] double weight(const Residual& residual) const {
    const double error_sq = residual.norm_sq();
    const double inlier = density(error_sq, residual.size);
    return inlier / (inlier + outlier(residual.size)) * (kFreedom + residual.size) /
           (kFreedom + error_sq);
  }

  /// Against that of a residual of 0.
  [[nodiscard]] double likelihood(double error_sq, int size) const {
    return (density(error_sq, size) + outlier(size)) / (1 + outlier(size));
  }

  /// Minus twice its logarithm.
  [[nodiscard]] double cost(double error_sq, int size) const {
    return -2 * std::log(likelihood(error_sq, size));
  }

  /// The likelihood of an outlier, against that of an inlier with a residual of 0.
  [[nodiscard]] double outlier(int size) const { return outlier_[size == 1 ? 0 : 1]; }

 private:
  static constexpr double kFreedom = 3;

  /// Against that of a residual of 0.
  static double density(double error_sq, int size) {
    const double share = 1 / (1 + error_sq / kFreedom);
    return size == 1 ? share * share : share * share * std::sqrt(share);
  }

  std::array<double, 2> outlier_;
};

RigidPose moved(const RigidPose& pose, const cv::Vec6d& step, FitKind kind) {
  RigidPose result;
  result.rotation = pose.rotation * rotation_by({step[3], step[4], step[5]});
  result.translation = pose.translation + pose.rotation * cv::Vec3d(step[0], step[1], step[2]);
  if (kind == FitKind::direction) result.translation = cv::normalize(result.translation);
  return result;
}

/// J^T W J, J^T W r and the cost.
struct PoseEquations {
  cv::Matx66d squares = cv::Matx66d::zeros();
  cv::Vec6d gradient;
  double cost = 0;
};

PoseEquations equations_of(std::span<const RayPair> pairs, const RigidPose& pose, FitKind kind,
                           const Noise& noise) {
  const PoseFrame frame(pose);
  PoseEquations sum;
  for (const RayPair& pair : pairs) {
    const Residual residual = residual_of(pair, frame, kind);
    const double weight = noise.weight(residual);
    sum.cost += noise.cost(residual.norm_sq(), residual.size);
    for (int row = 0; row < residual.size; ++row) {
      const auto jacobian = residual.jacobian.row(row);
      for (int a = 0; a < 6; ++a) {
        const double scaled = weight * jacobian(a);
        sum.gradient[a] += scaled * residual.value[row];
        for (int b = 0; b <= a; ++b) sum.squares(a, b) += scaled * jacobian(b);
      }
    }
  }
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < a; ++b) sum.squares(b, a) = sum.squares(a, b);
  }
  return sum;
}

const DirectionKernels& kernels() {
  return kernels_for<DirectionKernels>(active_instruction_set());
}

/// Minus twice the logarithm of a product of likelihoods, which may be too small for a number.
double cost_of_all(std::span<const double> likelihoods) {
  constexpr double kSmall = 1e-100;
  double cost = 0;
  double product = 1;
  for (const double likelihood : likelihoods) {
    product *= likelihood;
    if (product > kSmall) continue;
    cost -= 2 * std::log(product);
    product = 1;
  }
  return cost - 2 * std::log(product);
}

/// As the others, for rotation and direction.
PoseEquations equations_of(const RayBlocks& pairs, const RigidPose& pose, const Noise& noise) {
  DirectionSums sums;
  kernels().sum_up(direction_pose(pose), pairs.arrays(), static_cast<float>(noise.outlier(1)),
                   sums);
  PoseEquations result;
  std::size_t entry = 0;
  for (int a = 0; a < 6; ++a) {
    result.gradient[a] = static_cast<double>(sums.gradient[a]);
    for (int b = 0; b <= a; ++b, ++entry) {
      result.squares(a, b) = result.squares(b, a) = static_cast<double>(sums.squares[entry]);
    }
  }
  result.cost = cost_of_all(sums.likelihoods);
  return result;
}

/// The directions that are not fitted, as a projection on those that are.
cv::Matx66d fitted_directions(const RigidPose& pose, FitKind kind) {
  cv::Matx66d projection = cv::Matx66d::eye();
  if (kind == FitKind::metric) return projection;
  const cv::Vec3d along = pose.rotation.t() * pose.translation;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      projection(a, b) =
          kind == FitKind::rotation ? 0.0 : (a == b ? 1.0 : 0.0) - along[a] * along[b];
    }
  }
  return projection;
}

/// The inverse on what is fitted, and 0 elsewhere.
cv::Matx66d inverse_within(const cv::Matx66d& squares, const cv::Matx66d& projection) {
  const double size = std::max(cv::trace(squares) / 6, std::numeric_limits<double>::min());
  const cv::Matx66d rest = (cv::Matx66d::eye() - projection) * size;
  bool is_ok = false;
  const cv::Matx66d inverse =
      (projection * squares * projection + rest).inv(cv::DECOMP_CHOLESKY, &is_ok);
  if (!is_ok) return cv::Matx66d::eye() * 1e6;
  return projection * inverse * projection;
}

/// The step to where the equations are 0, within what is fitted, by Cholesky's method.
cv::Vec6d step_of(const PoseEquations& at, double damping, const RigidPose& pose, FitKind kind) {
  cv::Matx66d l = at.squares;
  cv::Vec6d step = -at.gradient;
  const double size = std::max(cv::trace(l), std::numeric_limits<double>::min());
  const cv::Vec3d along = pose.rotation.t() * pose.translation;
  for (int a = 0; a < 3; ++a) {
    if (kind == FitKind::rotation) {
      step[a] = 0;
      for (int b = 0; b < 6; ++b) l(a, b) = l(b, a) = a == b ? size : 0;
    } else if (kind == FitKind::direction) {
      for (int b = 0; b < 3; ++b) l(a, b) += size * along[a] * along[b];
    }
  }
  cv::Vec6d inverse;  // of the diagonal
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < a; ++b) {
      for (int k = 0; k < b; ++k) l(a, b) -= l(a, k) * l(b, k);
      l(a, b) *= inverse[b];
      step[a] -= l(a, b) * step[b];
    }
    double rest = l(a, a) * (1 + damping);
    for (int k = 0; k < a; ++k) rest -= l(a, k) * l(a, k);
    inverse[a] = 1 / std::sqrt(std::max(rest, 1e-12 * size));
    step[a] *= inverse[a];
  }
  for (int a = 5; a >= 0; --a) {
    for (int b = a + 1; b < 6; ++b) step[a] -= l(b, a) * step[b];
    step[a] *= inverse[a];
  }
  return step;
}

/// Levenberg and Marquardt's method; returns the cost. `equations` tells those of a pose.
template <typename EquationsOf>
double descend(const EquationsOf& equations, FitKind kind, int max_steps, RigidPose& pose) {
  constexpr double kMinGain = 0.01;  // far below what chance does to a cost
  double damping = 1e-4;
  PoseEquations at = equations(pose);
  for (int step = 0; step < max_steps; ++step) {
    const RigidPose next = moved(pose, step_of(at, damping, pose, kind), kind);
    const PoseEquations there = equations(next);
    if (!(there.cost < at.cost)) {
      if (damping > 1) break;
      damping *= 100;
      continue;
    }
    const double gain = at.cost - there.cost;
    pose = next;
    at = there;
    damping = std::max(damping / 10, 1e-7);
    if (gain < kMinGain) break;
  }
  return at.cost;
}

using Cell = std::array<int, 3>;

/// Keypoints of one object err together: its outline turns, its shadow moves. So those of one cell
/// count as one.
Cell cell_of(const RayPair& pair) {
  constexpr double kCell = 0.05;  // of a direction: about as wide as a descriptor
  const cv::Vec3d cell = pair.query.direction / kCell;
  return {cvFloor(cell[0]), cvFloor(cell[1]), cvFloor(cell[2])};
}

std::vector<std::vector<RayPair>> clusters_of(std::span<const RayPair> pairs) {
  std::map<Cell, std::vector<RayPair>> clusters;
  for (const RayPair& pair : pairs) clusters[cell_of(pair)].push_back(pair);
  std::vector<std::vector<RayPair>> result;
  result.reserve(clusters.size());
  for (auto& [cell, members] : clusters) result.push_back(std::move(members));
  return result;
}

void shuffle(std::vector<std::vector<RayPair>>& clusters, cv::RNG& chance) {
  for (std::size_t left = clusters.size(); left > 1; --left) {
    std::swap(clusters[left - 1],
              clusters[static_cast<std::size_t>(chance.uniform(0, static_cast<int>(left)))]);
  }
}

RigidPose refitted(std::span<const std::vector<RayPair>> clusters, const RigidPose& start,
                   FitKind kind, double gate) {
  std::vector<RayPair> pairs;
  for (const auto& cluster : clusters) pairs.insert(pairs.end(), cluster.begin(), cluster.end());
  return fit_pose(pairs, start, kind, gate).pose;
}

/// The motion (x, y, z, rx, ry, rz) in the frame of the query's camera that leads from `pose` to
/// `other`.
cv::Vec6d motion_between(const RigidPose& pose, const RigidPose& other) {
  const cv::Matx33d back = pose.rotation.t();
  cv::Vec3d turn;
  cv::Rodrigues(back * other.rotation, turn);
  const cv::Vec3d shift = back * (other.translation - pose.translation);
  return {shift[0], shift[1], shift[2], turn[0], turn[1], turn[2]};
}

/// The chance that noise changes which of two poses is likelier, by how much more one costs in each
/// cluster.
double chance_of_order(std::span<const double> differences) {
  double sum = 0;
  double squares = 0;
  for (const double difference : differences) {
    sum += difference;
    squares += difference * difference;
  }
  return std::erfc(sum / std::sqrt(2 * squares)) / 2;
}

/// The number of each pair's cluster.
std::vector<std::size_t> cluster_numbers(std::span<const RayPair> pairs) {
  std::map<Cell, std::size_t> numbers;
  std::vector<std::size_t> result;
  result.reserve(pairs.size());
  for (const RayPair& pair : pairs) {
    result.push_back(numbers.try_emplace(cell_of(pair), numbers.size()).first->second);
  }
  return result;
}

}  // namespace

DirectionPose direction_pose(const RigidPose& pose) {
  const PoseFrame frame(pose);
  DirectionPose result{};
  for (int i = 0; i < 9; ++i) result.rotation[i] = static_cast<float>(frame.rotation.val[i]);
  for (int i = 0; i < 3; ++i) result.translation[i] = static_cast<float>(frame.translation[i]);
  return result;
}

Residual residual_of(const RayPair& pair, const RigidPose& pose, FitKind kind) {
  return residual_of(pair, PoseFrame(pose), kind);
}

std::vector<float> errors_sq(const RayBlocks& pairs, const RigidPose& pose) {
  const RayArrays arrays = pairs.arrays();
  std::vector<float> result(arrays.stride);
  kernels().errors_sq(direction_pose(pose), arrays, result.data());
  result.resize(arrays.count);
  return result;
}

double epipolar_error_sq(const RayPair& pair, const cv::Matx33d& essential) {
  const cv::Vec3d normal = times(essential, pair.query.direction);
  const cv::Vec3d back_normal = transposed_times(essential, pair.match.direction);
  const cv::Vec2d by_match = transposed_times(pair.match.spread, normal);
  const cv::Vec2d by_query = transposed_times(pair.query.spread, back_normal);
  const double error = pair.match.direction.dot(normal);
  const double variance = by_match.dot(by_match) + by_query.dot(by_query);
  return variance > 0 ? error * error / variance : std::numeric_limits<double>::max();
}

cv::Matx33d essential_matrix(const RigidPose& pose) {
  return cross_matrix(pose.translation) * pose.rotation;
}

double cost_of(const RayBlocks& pairs, const RigidPose& pose, double gate) {
  const Noise noise(gate);
  std::vector<double> likelihoods;
  likelihoods.reserve(pairs.size());
  for (const float error_sq : errors_sq(pairs, pose)) {
    likelihoods.push_back(noise.likelihood(static_cast<double>(error_sq), 1));
  }
  return cost_of_all(likelihoods);
}

PoseFit fit_direction(const RayBlocks& pairs, const RigidPose& start, double gate, int max_steps) {
  const Noise noise(gate);
  PoseFit fit{.pose = start};
  const auto equations = [&](const RigidPose& pose) { return equations_of(pairs, pose, noise); };
  fit.cost = descend(equations, FitKind::direction, max_steps, fit.pose);
  return fit;
}

PoseFit fit_pose(std::span<const RayPair> pairs, const RigidPose& start, FitKind kind, double gate,
                 int max_steps) {
  if (kind == FitKind::direction) return fit_direction(RayBlocks(pairs), start, gate, max_steps);
  const Noise noise(gate);
  PoseFit fit{.pose = start};
  if (kind == FitKind::rotation) fit.pose.translation = {};
  const auto equations = [&](const RigidPose& pose) {
    return equations_of(pairs, pose, kind, noise);
  };
  fit.cost = descend(equations, kind, max_steps, fit.pose);
  return fit;
}

cv::Matx66d covariance_of(std::span<const RayPair> inliers, const RigidPose& pose, FitKind kind,
                          double gate) {
  const Noise noise(gate);
  const cv::Matx66d fitted = fitted_directions(pose, kind);
  const cv::Matx66d usual =
      inverse_within(equations_of(inliers, pose, kind, noise).squares, fitted);
  std::vector<std::vector<RayPair>> clusters = clusters_of(inliers);
  const std::size_t half = clusters.size() / 2;
  cv::RNG chance(1);
  cv::Matx66d spread = cv::Matx66d::zeros();
  for (int split = 0; split < kSplits; ++split) {
    shuffle(clusters, chance);
    for (const auto part : {std::span(clusters).first(half), std::span(clusters).subspan(half)}) {
      const cv::Vec6d motion = motion_between(pose, refitted(part, pose, kind, gate));
      spread += motion * motion.t() * (0.5 / kSplits);
    }
  }
  // The mean of both, each of as many degrees of freedom as there are splits. The inverse of an
  // estimated covariance is too large by this factor on average (Anderson, "An Introduction to
  // Multivariate Statistical Analysis", 2003, section 7.7).
  constexpr double kFreedom = 2 * kSplits;
  const double inflated = kFreedom / (kFreedom - cv::trace(fitted) - 1);
  return (fitted * spread * fitted + usual) * (inflated / 2);
}

cv::Matx66d rivalry_of(std::span<const RayPair> pairs, const RigidPose& pose,
                       std::span<const PoseFit> rivals, double gate) {
  const Noise noise(gate);
  const RayBlocks blocks(pairs);
  const std::vector<std::size_t> clusters = cluster_numbers(pairs);
  const std::vector<float> errors = errors_sq(blocks, pose);
  const auto differences = [&](const RigidPose& rival) {
    std::vector<double> result(pairs.size());
    const std::vector<float> rival_errors = errors_sq(blocks, rival);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double likelihood = noise.likelihood(static_cast<double>(errors[i]), 1);
      const double of_rival = noise.likelihood(static_cast<double>(rival_errors[i]), 1);
      result[clusters[i]] += std::log(likelihood / of_rival);
    }
    return result;
  };
  const cv::Matx66d fitted = fitted_directions(pose, FitKind::direction);
  cv::Matx66d spread = cv::Matx66d::zeros();
  double all_odds = 1;
  for (const PoseFit& rival : rivals) {
    const double chance = chance_of_order(differences(rival.pose));
    const double odds = chance / std::max(1 - chance, std::numeric_limits<double>::min());
    const cv::Vec6d motion = fitted * motion_between(pose, rival.pose);
    spread += motion * motion.t() * odds;
    all_odds += odds;
  }
  return spread * (1 / all_odds);
}

}  // namespace loopbit
