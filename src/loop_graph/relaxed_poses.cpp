// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "relaxed_poses.hpp"

#include <Eigen/SVD>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cstddef>

namespace loopbit::graph {
namespace {

using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// Normal equations of differences x_to - M x_from = d, in blocks of `size` rows.
class Differences {
 public:
  Differences(int count, int size)
      : size_(size), right_(Columns::Zero(Eigen::Index{count} * size, 3)) {}

  void add(int from, int to, const Eigen::MatrixXd& m, const Eigen::MatrixXd& d, double weight) {
    const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(size_, size_);
    put(to, to, weight * one);
    put(from, from, weight * m.transpose() * m);
    // The lower triangle is enough.
    if (to > from) {
      put(to, from, -weight * m);
    } else {
      put(from, to, -weight * m.transpose());
    }
    right_.middleRows(Eigen::Index{to} * size_, size_) += weight * d;
    right_.middleRows(Eigen::Index{from} * size_, size_) -= weight * m.transpose() * d;
  }
  void fix(int block, const Eigen::MatrixXd& value) {
    constexpr double kWeight = 1e9;
    put(block, block, kWeight * Eigen::MatrixXd::Identity(size_, size_));
    right_.middleRows(Eigen::Index{block} * size_, size_) += kWeight * value;
  }
  [[nodiscard]] Columns solve() const {
    Eigen::SparseMatrix<double> left(right_.rows(), right_.rows());
    left.setFromTriplets(left_.begin(), left_.end());
    return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(left).solve(right_);
  }

 private:
  void put(int row, int column, const Eigen::MatrixXd& block) {
    for (int i = 0; i < size_; ++i) {
      for (int j = 0; j < size_; ++j) {
        left_.emplace_back(row * size_ + i, column * size_ + j, block(i, j));
      }
    }
  }

  int size_;
  std::vector<Eigen::Triplet<double>> left_;
  Columns right_;
};

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

std::vector<Pose> relaxed_poses(int count, std::span<const WeighedMotion> motions,
                                std::span<const int> fixed) {
  // Transposed rotations, so that each column stands alone.
  Differences rotations(count, 3);
  for (const WeighedMotion& motion : motions) {
    const Eigen::Matrix3d back =
        Eigen::Quaterniond(motion.T_from_to.data() + 3).conjugate().toRotationMatrix();
    rotations.add(motion.from, motion.to, back, Eigen::Matrix3d::Zero(), motion.rotation_weight);
  }
  for (const int keyframe : fixed) rotations.fix(keyframe, Eigen::Matrix3d::Identity());
  const Columns columns = rotations.solve();
  std::vector<Pose> poses(static_cast<std::size_t>(count), kIdentity);
  for (int k = 0; k < count; ++k) {
    const Eigen::Quaterniond q(
        nearest_rotation(columns.middleRows<3>(Eigen::Index{3} * k).transpose()));
    Eigen::Map<Eigen::Vector4d>(poses[static_cast<std::size_t>(k)].data() + 3) = q.coeffs();
  }
  Differences positions(count, 1);
  for (const WeighedMotion& motion : motions) {
    const Eigen::Quaterniond from(poses[static_cast<std::size_t>(motion.from)].data() + 3);
    const Eigen::Vector3d moved = from * Eigen::Vector3d(motion.T_from_to.data());
    positions.add(motion.from, motion.to, Eigen::MatrixXd::Identity(1, 1), moved.transpose(),
                  motion.position_weight);
  }
  for (const int keyframe : fixed) positions.fix(keyframe, Eigen::RowVector3d::Zero());
  const Columns solved = positions.solve();
  for (int k = 0; k < count; ++k) {
    Eigen::Map<Eigen::Vector3d>(poses[static_cast<std::size_t>(k)].data()) = solved.row(k);
  }
  // Exactly, not only within rounding.
  for (const int keyframe : fixed) poses[static_cast<std::size_t>(keyframe)] = kIdentity;
  return poses;
}

}  // namespace loopbit::graph
