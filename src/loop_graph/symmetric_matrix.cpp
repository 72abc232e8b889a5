// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "symmetric_matrix.hpp"

namespace loopbit::graph {

Matrix6d carried(const Matrix6d& carry, const Matrix6d& covariance) {
  return carry * covariance * carry.transpose();
}

Factors::Factors(const Matrix6d& matrix) : factors_(matrix) {}

bool Factors::are_positive() const {
  return factors_.info() == Eigen::Success && factors_.vectorD().minCoeff() > 0;
}

Matrix6d Factors::square_root() const {
  Matrix6d lower = factors_.matrixL();
  lower = factors_.transpositionsP().transpose() * lower;
  const Vector6d roots = factors_.vectorD().cwiseMax(0).cwiseSqrt();
  return roots.asDiagonal() * lower.transpose();
}

Matrix6d Factors::inverse() const {
  const Matrix6d inverse = factors_.solve(Matrix6d::Identity());
  return (inverse + inverse.transpose()) / 2;
}

double Factors::mahalanobis_sq(const Vector6d& v) const { return v.dot(factors_.solve(v)); }

}  // namespace loopbit::graph
