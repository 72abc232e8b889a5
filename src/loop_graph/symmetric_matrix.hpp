// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Cholesky>

/// What pose graphs do with symmetric matrices, in one source: each of Eigen's expressions on
/// matrices of six rows takes the compiler a second or more.
namespace loopbit::graph {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// A covariance in another frame: carry * covariance * carry'.
Matrix6d carried(const Matrix6d& carry, const Matrix6d& covariance);

/// M = P' L D L' P of a matrix M without negative eigenvalues: a permutation, a triangle with ones
/// on its diagonal, and a diagonal.
class Factors {
 public:
  explicit Factors(const Matrix6d& matrix);

  /// All of D, so that M has an inverse.
  [[nodiscard]] bool are_positive() const;
  /// S with S' S = M.
  [[nodiscard]] Matrix6d square_root() const;
  /// If they are positive. Symmetric to the last bit.
  [[nodiscard]] Matrix6d inverse() const;
  /// v' M^-1 v
  [[nodiscard]] double mahalanobis_sq(const Vector6d& v) const;

 private:
  Eigen::LDLT<Matrix6d> factors_;
};

}  // namespace loopbit::graph
