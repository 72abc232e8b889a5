// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

/// What pose graphs do with symmetric matrices, in plain loops: each expression of Eigen's on
/// matrices of six rows takes the compiler a second or more.
namespace loopbit::graph {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// A covariance in another frame: carry * covariance * carry'.
Matrix6d carried(const Matrix6d& carry, const Matrix6d& covariance);

/// M = L D L', with ones on the diagonal of L and no exchange of rows.
class Factors {
 public:
  explicit Factors(const Matrix6d& matrix);

  [[nodiscard]] bool are_positive() const { return pivots_.minCoeff() > 0; }
  /// S with S' S = M. Rows of what M does not tell are 0.
  [[nodiscard]] Matrix6d square_root() const;
  /// If they are positive.
  [[nodiscard]] Matrix6d inverse() const;
  /// v' M^-1 v, without the rows whose factor is 0.
  [[nodiscard]] double mahalanobis_sq(const Vector6d& v) const;

 private:
  Matrix6d lower_ = Matrix6d::Identity();
  Vector6d pivots_ = Vector6d::Zero();
};

}  // namespace loopbit::graph
