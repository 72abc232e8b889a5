// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "symmetric_matrix.hpp"

#include <cmath>

namespace loopbit::graph {
namespace {

/// a * b'
Matrix6d times_transposed(const Matrix6d& a, const Matrix6d& b) {
  Matrix6d product = Matrix6d::Zero();
  for (int column = 0; column < 6; ++column) {
    for (int k = 0; k < 6; ++k) {
      for (int row = 0; row < 6; ++row) product(row, column) += a(row, k) * b(column, k);
    }
  }
  return product;
}

}  // namespace

Matrix6d carried(const Matrix6d& carry, const Matrix6d& covariance) {
  // The middle one is symmetric.
  return times_transposed(times_transposed(carry, covariance), carry);
}

Factors::Factors(const Matrix6d& matrix) {
  constexpr double kRounding = 1e-14;
  for (int column = 0; column < 6; ++column) {
    for (int row = column; row < 6; ++row) {
      double rest = matrix(row, column);
      for (int k = 0; k < column; ++k) rest -= lower_(row, k) * pivots_[k] * lower_(column, k);
      if (row > column) {
        lower_(row, column) = rest / pivots_[column];
      } else if (rest > kRounding * matrix(row, row)) {
        pivots_[row] = rest;
      } else {
        break;  // no part of it is left
      }
    }
  }
}

double Factors::mahalanobis_sq(const Vector6d& v) const {
  Vector6d solved = v;
  double sum = 0;
  for (int row = 0; row < 6; ++row) {
    for (int k = 0; k < row; ++k) solved[row] -= lower_(row, k) * solved[k];
    if (pivots_[row] > 0) sum += solved[row] * solved[row] / pivots_[row];
  }
  return sum;
}

Matrix6d Factors::inverse() const {
  // L^-1, row by row.
  Matrix6d back = Matrix6d::Identity();
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < row; ++column) {
      for (int k = column; k < row; ++k) back(row, column) -= lower_(row, k) * back(k, column);
    }
  }
  Matrix6d inverse = Matrix6d::Zero();
  for (int column = 0; column < 6; ++column) {
    for (int row = 0; row <= column; ++row) {
      for (int k = column; k < 6; ++k) {
        inverse(row, column) += back(k, row) * back(k, column) / pivots_[k];
      }
      inverse(column, row) = inverse(row, column);
    }
  }
  return inverse;
}

Matrix6d Factors::square_root() const {
  Matrix6d root;
  for (int row = 0; row < 6; ++row) {
    const double scale = std::sqrt(pivots_[row]);
    for (int column = 0; column < 6; ++column) root(row, column) = scale * lower_(column, row);
  }
  return root;
}

}  // namespace loopbit::graph
