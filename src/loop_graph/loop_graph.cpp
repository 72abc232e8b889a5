// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/loop_graph.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/rigid_motion.hpp"

#include "graph_impl.hpp"
#include "pose_problem.hpp"

namespace loopbit {
namespace graph {

Pose pose_of(const cv::Matx44d& transform) {
  Eigen::Matrix3d rotation;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) rotation(row, column) = transform(row, column);
  }
  const Eigen::Quaterniond q = Eigen::Quaterniond(rotation).normalized();
  const double sign = q.w() < 0 ? -1 : 1;
  return {transform(0, 3), transform(1, 3), transform(2, 3), sign * q.x(),
          sign * q.y(),    sign * q.z(),    sign * q.w()};
}

namespace {

Eigen::Quaterniond rotation_of(const Pose& pose) { return Eigen::Quaterniond(pose.data() + 3); }
Eigen::Vector3d position_of(const Pose& pose) { return Eigen::Vector3d(pose.data()); }

Pose pose_of(const Eigen::Vector3d& t, const Eigen::Quaterniond& rotation) {
  const Eigen::Quaterniond q = rotation.normalized();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

}  // namespace

cv::Matx44d matrix_of(const Pose& pose) {
  const Eigen::Matrix3d r = rotation_of(pose).toRotationMatrix();
  return {r(0, 0), r(0, 1), r(0, 2), pose[0], r(1, 0), r(1, 1), r(1, 2), pose[1],
          r(2, 0), r(2, 1), r(2, 2), pose[2], 0,       0,       0,       1};
}

Pose inverse(const Pose& pose) {
  const Eigen::Quaterniond back = rotation_of(pose).conjugate();
  return pose_of(-(back * position_of(pose)), back);
}

Pose times(const Pose& a, const Pose& b) {
  return pose_of(position_of(a) + rotation_of(a) * position_of(b), rotation_of(a) * rotation_of(b));
}

Pose between(const Pose& a, const Pose& b) { return times(inverse(a), b); }

Matrix6d adjoint(const Pose& pose) { return eigen_of(rigid::adjoint(matrix_of(pose))); }

Matrix6d eigen_of(const cv::Matx66d& matrix) {
  return Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(matrix.val);
}

cv::Matx66d cv_of(const Matrix6d& matrix) {
  cv::Matx66d result;
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(result.val) = matrix;
  return result;
}

double chi2_limit(double confidence, int freedom) {
  // The normal deviate by bisection: a few microseconds, once per graph.
  double low = -10;
  double high = 10;
  while (high - low > 1e-12) {
    const double middle = (low + high) / 2;
    (std::erfc(-middle / std::numbers::sqrt2) / 2 < confidence ? low : high) = middle;
  }
  const double ninths = 2.0 / (9 * freedom);
  return freedom * std::pow(1 - ninths + low * std::sqrt(ninths), 3);
}

}  // namespace graph

namespace {

using graph::Edge;
using graph::Matrix6d;
using graph::Pose;

/// The inverse of a covariance, as large as what is known. None if it has no inverse.
std::optional<Matrix6d> information_of(const Matrix6d& covariance, int first) {
  if (!covariance.allFinite()) return std::nullopt;
  Matrix6d known = covariance;
  for (int i = 0; i < first; ++i) {
    known.row(i).setZero();
    known.col(i).setZero();
    known(i, i) = 1;
  }
  const graph::Factors factors(known);
  if (!factors.are_positive()) return std::nullopt;
  Matrix6d information = factors.inverse();
  for (int i = 0; i < first; ++i) information(i, i) = 0;
  return information;
}

/// The same for a direction, whose covariance has no part along `ahead`, a unit vector.
std::optional<Matrix6d> information_across(const Matrix6d& covariance,
                                           const Eigen::Vector3d& ahead) {
  Matrix6d filled = covariance;
  filled.topLeftCorner<3, 3>() += ahead * ahead.transpose();
  auto information = information_of(filled, 0);
  if (information) {
    Matrix6d across = Matrix6d::Identity();
    across.topLeftCorner<3, 3>() -= ahead * ahead.transpose();
    *information = graph::carried(across, *information);
  }
  return information;
}

[[noreturn]] void throw_bad_loop(const LoopEdge& loop, const std::string& fault) {
  throw Error(ErrorKind::input,
              fmt::format("The loop of keyframes {} and {} {}", loop.query, loop.match, fault));
}

}  // namespace

namespace graph {

Edge edge_of(const LoopEdge& loop, const LoopGraphOptions& options) {
  check_odometry({loop.T_match_query},
                 fmt::format("The loop of keyframes {} and {}", loop.query, loop.match));
  Edge edge{loop.match, loop.query, loop.known, pose_of(loop.T_match_query)};
  constexpr double kRadians = std::numbers::pi / 180;
  const double position_sq = options.least_position_m * options.least_position_m;
  const double rotation = options.least_rotation_deg * kRadians;
  Matrix6d covariance = eigen_of(loop.covariance);
  covariance.bottomRightCorner<3, 3>().diagonal().array() += rotation * rotation;
  std::optional<Matrix6d> information;
  switch (loop.known) {
    case PoseKnown::metric:
      covariance.topLeftCorner<3, 3>().diagonal().array() += position_sq;
      information = information_of(covariance, 0);
      break;
    case PoseKnown::direction: {
      const Eigen::Vector3d t(edge.measured.data());
      if (!(std::abs(t.norm() - 1) < 1e-3)) throw_bad_loop(loop, "needs a direction of length 1.");
      const Eigen::Quaterniond q(edge.measured.data() + 3);
      information = information_across(covariance, q.conjugate() * t.normalized());
      break;
    }
    case PoseKnown::rotation:
      information = information_of(covariance, 3);
      break;
    case PoseKnown::nothing:
      information = Matrix6d::Zero();
  }
  if (!information) {
    throw_bad_loop(loop,
                   "has a covariance that is not positive definite: give one of "
                   "(x, y, z, rx, ry, rz) of what is known.");
  }
  edge.information = *information;
  return edge;
}

}  // namespace graph

std::string_view to_string(LoopVerdict verdict) {
  switch (verdict) {
    case LoopVerdict::undecided:
      return "undecided";
    case LoopVerdict::kept:
      return "kept";
    case LoopVerdict::unreachable:
      return "unreachable";
    case LoopVerdict::inconsistent:
      return "inconsistent";
    case LoopVerdict::outlier:
      return "outlier";
  }
  return "";
}

LoopEdge loop_edge(int match, int query, const RelativePose& pose) {
  return {match, query, pose.known, pose.T_match_query, pose.covariance};
}

LoopGraph::LoopGraph(const LoopGraphOptions& options) : impl_(std::make_unique<Impl>(options)) {}
LoopGraph::~LoopGraph() = default;
LoopGraph::LoopGraph(LoopGraph&&) noexcept = default;
LoopGraph& LoopGraph::operator=(LoopGraph&&) noexcept = default;

int LoopGraph::add_keyframe() { return impl_->add_keyframe(std::nullopt); }

int LoopGraph::add_keyframe(const Motion& motion) {
  const int keyframe = size();
  const std::string name = fmt::format("The odometry of keyframe {}", keyframe);
  if (keyframe == 0) {
    throw Error(ErrorKind::input, name + " has no keyframe before it: add the first one without.");
  }
  check_odometry({motion.T_from_to, motion.covariance}, name);
  const auto information = information_of(graph::eigen_of(motion.covariance), 0);
  return impl_->add_keyframe(Edge{keyframe - 1, keyframe, PoseKnown::metric,
                                  graph::pose_of(motion.T_from_to), information.value()});
}

int LoopGraph::add_loop(const LoopEdge& loop) {
  const bool exist = std::min(loop.match, loop.query) >= 0 &&
                     std::max(loop.match, loop.query) < size() && loop.match != loop.query;
  if (!exist) {
    throw_bad_loop(loop, fmt::format("needs two different keyframes from 0 to {}.", size() - 1));
  }
  return impl_->add_loop(loop, graph::edge_of(loop, impl_->options()));
}

void LoopGraph::update() { impl_->update(); }
void LoopGraph::solve() { impl_->solve(); }
int LoopGraph::size() const { return static_cast<int>(impl_->poses().size()); }

cv::Matx44d LoopGraph::pose(int keyframe) const {
  return graph::matrix_of(impl_->poses().at(static_cast<std::size_t>(keyframe)));
}

std::vector<int> LoopGraph::worlds() const { return impl_->worlds(); }

std::optional<Motion> LoopGraph::odometry(int keyframe) const {
  const auto& edge = impl_->keyframes().at(static_cast<std::size_t>(keyframe)).odometry;
  if (!edge) return std::nullopt;
  return Motion{graph::matrix_of(edge->measured),
                graph::cv_of(graph::Factors(edge->information).inverse())};
}

const std::vector<JudgedLoop>& LoopGraph::loops() const { return impl_->loops(); }
double LoopGraph::cost() const { return impl_->cost(); }

}  // namespace loopbit
