// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "pose_problem.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <ceres/product_manifold.h>
#include <ceres/solver.h>

namespace loopbit::graph {
namespace {

using Matrix34 = Eigen::Matrix<double, 3, 4>;
using Matrix37 = Eigen::Matrix<double, 3, 7>;
using Matrix67 = Eigen::Matrix<double, 6, 7>;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  return (Eigen::Matrix3d() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished();
}

/// Rows x, y, z of q * p as a function of p = (x, y, z, w).
Matrix34 left_product(const Eigen::Quaterniond& q) {
  Matrix34 product;
  product << q.w() * Eigen::Matrix3d::Identity() + cross_matrix(q.vec()), q.vec();
  return product;
}

/// Rows x, y, z of q * conjugate(p) * r as a function of p = (x, y, z, w).
Matrix34 middle_product(const Eigen::Quaterniond& q, const Eigen::Quaterniond& r) {
  Matrix34 product;
  for (int i = 0; i < 4; ++i) {
    Eigen::Quaterniond unit(0, 0, 0, 0);
    unit.coeffs()[i] = 1;
    product.col(i) = (q * unit.conjugate() * r).vec();
  }
  return product;
}

/// A value and its derivatives by the numbers of both poses.
struct Derived {
  Eigen::Vector3d value;
  Matrix37 by_from = Matrix37::Zero();
  Matrix37 by_to = Matrix37::Zero();
};

/// The position of `to` in the frame of `from`.
Derived moved(const Pose& from, const Pose& to) {
  const Eigen::Quaterniond q(from.data() + 3);
  const Eigen::Vector3d v = Eigen::Vector3d(to.data()) - Eigen::Vector3d(from.data());
  const Eigen::Vector3d u = q.vec();
  Derived result{q.conjugate() * v};
  result.by_to.leftCols<3>() = q.conjugate().toRotationMatrix();
  result.by_from.leftCols<3>() = -result.by_to.leftCols<3>();
  // R' v = v - 2 w (u x v) + 2 u x (u x v)
  result.by_from.middleCols<3>(3) =
      2 * q.w() * cross_matrix(v) +
      2 * (u.dot(v) * Eigen::Matrix3d::Identity() + u * v.transpose() - 2 * v * u.transpose());
  result.by_from.col(6) = -2 * u.cross(v);
  return result;
}

/// Twice the tangent of half the angle between `seen` and the unit vector `ahead`, across `ahead`.
/// It grows up to the opposite direction. Of cameras at one point no direction is wrong.
Eigen::Vector3d direction_error(const Eigen::Vector3d& seen, const Eigen::Vector3d& ahead,
                                Eigen::Matrix3d& by_seen) {
  constexpr double kSamePoint_m = 0.02;
  constexpr double kLeast = -0.95;  // 162 degrees; the scale stays as it is beyond
  const double length = std::sqrt(seen.squaredNorm() + kSamePoint_m * kSamePoint_m);
  const Eigen::Vector3d unit = seen / length;
  const double along = unit.dot(ahead);
  const double scale = 2 / (1 + std::max(along, kLeast));
  const Eigen::Vector3d across = unit - ahead * along;
  Eigen::Matrix3d by_unit = scale * (Eigen::Matrix3d::Identity() - ahead * ahead.transpose());
  if (along > kLeast) by_unit -= scale * scale / 2 * across * ahead.transpose();
  by_seen = by_unit * (Eigen::Matrix3d::Identity() - unit * unit.transpose()) / length;
  return scale * across;
}

/// The residuals of an edge. With E = T_measured^-1 T_estimated they are its translation and twice
/// the vector of its quaternion, times the root of the information: g2o's error, in radians. An
/// edge without a length has the translation's direction in place of the translation, and three
/// residuals more: the translation in units of `seen_within_m`.
class EdgeCost final : public ceres::CostFunction {
 public:
  EdgeCost(const Edge& edge, double seen_within_m)
      : is_metric_(edge.known == PoseKnown::metric),
        translation_(edge.measured.data()),
        back_(Eigen::Quaterniond(edge.measured.data() + 3).conjugate()),
        root_(Factors(edge.information).square_root()),
        nearness_(1 / seen_within_m) {
    set_num_residuals(is_metric_ ? 6 : 9);
    mutable_parameter_block_sizes()->assign({7, 7});
  }

  bool Evaluate(double const* const* poses, double* residuals, double** jacobians) const override {
    Pose from;
    Pose to;
    std::copy_n(poses[0], from.size(), from.begin());
    std::copy_n(poses[1], to.size(), to.begin());
    const Derived m = moved(from, to);
    const Eigen::Quaterniond half = back_ * Eigen::Quaterniond(from.data() + 3).conjugate();
    const Eigen::Quaterniond q_to(to.data() + 3);
    const Eigen::Quaterniond turn = half * q_to;
    const double twice = turn.w() < 0 ? -2 : 2;

    Vector6d error;
    Eigen::Matrix3d by_moved = back_.toRotationMatrix();
    if (is_metric_) {
      error.head<3>() = by_moved * (m.value - translation_);
    } else {
      Eigen::Matrix3d by_seen;
      error.head<3>() = direction_error(by_moved * m.value, by_moved * translation_, by_seen);
      by_moved = by_seen * by_moved;
    }
    error.tail<3>() = twice * turn.vec();
    Eigen::Map<Vector6d>(residuals, 6) = root_ * error;
    if (!is_metric_) Eigen::Map<Eigen::Vector3d>(residuals + 6) = nearness_ * m.value;
    if (jacobians == nullptr) return true;
    put(by_moved, m.by_from, twice * middle_product(back_, q_to), jacobians[0]);
    put(by_moved, m.by_to, twice * left_product(half), jacobians[1]);
    return true;
  }

 private:
  void put(const Eigen::Matrix3d& by_moved, const Matrix37& moved_by, const Matrix34& turn_by,
           double* jacobian) const {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, 7, Eigen::RowMajor>;
    if (jacobian == nullptr) return;
    Matrix67 error_by = Matrix67::Zero();
    error_by.topRows<3>() = by_moved * moved_by;
    error_by.bottomRightCorner<3, 4>() = turn_by;
    Eigen::Map<RowMajor> result(jacobian, num_residuals(), 7);
    result.topRows<6>() = root_ * error_by;
    if (!is_metric_) result.bottomRows<3>() = nearness_ * moved_by;
  }

  bool is_metric_;
  Eigen::Vector3d translation_;
  Eigen::Quaterniond back_;  ///< inverse of the measured rotation
  Matrix6d root_;
  double nearness_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> cost_function(const Edge& edge, double seen_within_m) {
  return std::make_unique<EdgeCost>(edge, seen_within_m);
}

double chi2_of(const Edge& edge, const Pose& from, const Pose& to, double seen_within_m) {
  const std::array<const double*, 2> poses{from.data(), to.data()};
  Eigen::Matrix<double, 9, 1> residuals = Eigen::Matrix<double, 9, 1>::Zero();
  EdgeCost(edge, seen_within_m).Evaluate(poses.data(), residuals.data(), nullptr);
  return residuals.squaredNorm();
}

int freedom_of(PoseKnown known) {
  switch (known) {
    case PoseKnown::metric:
    case PoseKnown::rotation:
      return 6;
    case PoseKnown::direction:
      return 8;
    case PoseKnown::nothing:
      break;
  }
  return 3;
}

ceres::Problem::Options PoseProblem::problem_options() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.enable_fast_removal = true;
  options.disable_all_safety_checks = true;
  return options;
}

PoseProblem::PoseProblem(std::vector<Pose>& poses, double seen_within_m)
    : poses_(poses),
      seen_within_m_(seen_within_m),
      manifold_(std::make_unique<ceres::ProductManifold<ceres::EuclideanManifold<3>,
                                                        ceres::EigenQuaternionManifold>>()),
      problem_(problem_options()) {}

void PoseProblem::add(const Edge& edge, double weight) {
  double* from = poses_[static_cast<std::size_t>(edge.from)].data();
  double* to = poses_[static_cast<std::size_t>(edge.to)].data();
  for (double* pose : {from, to}) {
    if (!problem_.HasParameterBlock(pose)) problem_.AddParameterBlock(pose, 7, manifold_.get());
  }
  terms_.push_back({.from = from, .to = to, .cost = cost_function(edge, seen_within_m_)});
  set_weight(terms_.size() - 1, weight);
}

void PoseProblem::set_weight(std::size_t edge, double weight) {
  Term& term = terms_[edge];
  term.loss.weight = weight;
  if (weight == 0 && term.block != nullptr) {
    problem_.RemoveResidualBlock(term.block);
    term.block = nullptr;
  } else if (weight > 0 && term.block == nullptr) {
    term.block = problem_.AddResidualBlock(term.cost.get(), &term.loss, term.from, term.to);
  }
}

void PoseProblem::fix(int keyframe) {
  double* pose = poses_[static_cast<std::size_t>(keyframe)].data();
  if (problem_.HasParameterBlock(pose)) problem_.SetParameterBlockConstant(pose);
}

double PoseProblem::solve(int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  // It sums in the same order with any BLAS.
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = 1e-7;
  options.num_threads = 1;
  // Nearly a Gauss-Newton step: more damping holds long chains back.
  options.initial_trust_region_radius = 1e10;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  return summary.final_cost;
}

}  // namespace loopbit::graph
