// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "relaxed_poses.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cstddef>

#include "loopbit/ray_geometry.hpp"

namespace loopbit::graph {
namespace {

using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// Normal equations of differences x_to - M x_from = d, with a rotation M of `size` rows.
class Differences {
 public:
  Differences(int count, int size)
      : size_(size), right_(Columns::Zero(Eigen::Index{count} * size, 3)) {}

  void add(int from, int to, const Eigen::Matrix3d& m, double weight) {
    for (int i = 0; i < size_; ++i) {
      put(to, i, to, i, weight);
      put(from, i, from, i, weight);
      for (int j = 0; j < size_; ++j) {
        // The lower triangle is enough.
        to > from ? put(to, i, from, j, -weight * m(i, j)) : put(from, j, to, i, -weight * m(i, j));
      }
    }
  }
  /// Moves row 0 of a block.
  void add_right(int block, const Eigen::Vector3d& d) {
    for (int i = 0; i < 3; ++i) right_(Eigen::Index{block} * size_, i) += d[i];
  }
  /// To the identity, or to 0 if a block is one row.
  void fix(int block) {
    constexpr double kWeight = 1e9;
    for (int i = 0; i < size_; ++i) {
      put(block, i, block, i, kWeight);
      if (size_ == 3) right_(Eigen::Index{block} * size_ + i, i) += kWeight;
    }
  }
  [[nodiscard]] Columns solve() const {
    Eigen::SparseMatrix<double> left(right_.rows(), right_.rows());
    left.setFromTriplets(left_.begin(), left_.end());
    return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(left).solve(right_);
  }

 private:
  void put(int row_block, int row, int column_block, int column, double value) {
    left_.emplace_back(row_block * size_ + row, column_block * size_ + column, value);
  }

  int size_;
  std::vector<Eigen::Triplet<double>> left_;
  Columns right_;
};

}  // namespace

std::vector<Pose> relaxed_poses(int count, std::span<const WeighedMotion> motions,
                                std::span<const int> fixed) {
  // Transposed rotations, so that each column stands alone.
  Differences rotations(count, 3);
  for (const WeighedMotion& motion : motions) {
    const Eigen::Quaterniond rotation(motion.T_from_to.data() + 3);
    rotations.add(motion.from, motion.to, rotation.conjugate().toRotationMatrix(),
                  motion.rotation_weight);
  }
  for (const int keyframe : fixed) rotations.fix(keyframe);
  const Columns columns = rotations.solve();
  std::vector<Pose> poses(static_cast<std::size_t>(count), kIdentity);
  for (int k = 0; k < count; ++k) {
    cv::Matx33d sum;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) sum(i, j) = columns(Eigen::Index{3} * k + j, i);
    }
    const cv::Matx33d r = best_rotation(sum);
    poses[static_cast<std::size_t>(k)] =
        pose_of({r(0, 0), r(0, 1), r(0, 2), 0, r(1, 0), r(1, 1), r(1, 2), 0,  //
                 r(2, 0), r(2, 1), r(2, 2), 0, 0, 0, 0, 1});
  }
  Differences positions(count, 1);
  for (const WeighedMotion& motion : motions) {
    const Eigen::Quaterniond from(poses[static_cast<std::size_t>(motion.from)].data() + 3);
    const Eigen::Vector3d moved = from * Eigen::Vector3d(motion.T_from_to.data());
    const double weight = motion.position_weight;
    positions.add(motion.from, motion.to, Eigen::Matrix3d::Identity(), weight);
    positions.add_right(motion.to, weight * moved);
    positions.add_right(motion.from, -weight * moved);
  }
  for (const int keyframe : fixed) positions.fix(keyframe);
  const Columns solved = positions.solve();
  for (int k = 0; k < count; ++k) {
    for (int i = 0; i < 3; ++i) {
      poses[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)] = solved(k, i);
    }
  }
  // Exactly, not only within rounding.
  for (const int keyframe : fixed) poses[static_cast<std::size_t>(keyframe)] = kIdentity;
  return poses;
}

}  // namespace loopbit::graph
