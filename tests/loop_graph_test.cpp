// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/loop_graph.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <ceres/ceres.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "loopbit/g2o_file.hpp"
#include "loopbit/rigid_motion.hpp"

#include "../bench/synthetic_graph.hpp"
#include "path_covariance.hpp"
#include "pose_problem.hpp"
#include "relaxed_poses.hpp"
#include "test_support.hpp"

namespace loopbit {

std::ostream& operator<<(std::ostream& stream, LoopVerdict verdict) {
  return stream << to_string(verdict);
}

namespace test {
namespace {

using bench::SyntheticGraph;

cv::Matx66d diagonal(double position_m, double rotation) {
  const double p = position_m * position_m;
  const double r = rotation * rotation;
  return cv::Matx66d::diag({p, p, p, r, r, r});
}

/// Covariances are used as they are.
constexpr LoopGraphOptions kExact{.least_position_m = 0, .least_rotation_deg = 0};

LoopGraph graph_of(const SyntheticGraph& synthetic, const LoopGraphOptions& options = {}) {
  LoopGraph graph(options);
  graph.add_keyframe();
  for (const Motion& motion : synthetic.odometry) graph.add_keyframe(motion);
  for (const LoopEdge& loop : synthetic.loops) graph.add_loop(loop);
  return graph;
}

std::vector<cv::Matx44d> poses_of(const LoopGraph& graph) {
  std::vector<cv::Matx44d> poses;
  for (int k = 0; k < graph.size(); ++k) poses.push_back(graph.pose(k));
  return poses;
}

std::vector<LoopVerdict> verdicts_of(const LoopGraph& graph) {
  std::vector<LoopVerdict> verdicts;
  for (const JudgedLoop& loop : graph.loops()) verdicts.push_back(loop.verdict);
  return verdicts;
}

/// Four steps of 1 m straight on, each with a standard deviation of 0.1 m; a loop with one of 0.1 m
/// says that they were 4.5 m. The error of 0.5 m is shared by 5 equal variances.
TEST(LoopGraphTest, ErrorIsSharedByVariances) {
  LoopGraph graph(kExact);
  graph.add_keyframe();
  for (int k = 0; k < 4; ++k) graph.add_keyframe({level_pose(0, 1, 0), diagonal(0.1, 0.001)});
  graph.add_loop({0, 4, PoseKnown::metric, level_pose(0, 4.5, 0), diagonal(0.1, 0.001)});
  graph.solve();
  ASSERT_EQ(graph.loops()[0].verdict, LoopVerdict::kept);
  for (int k = 0; k <= 4; ++k) EXPECT_NEAR(graph.pose(k)(2, 3), 1.1 * k, 1e-6) << k;
  // Each of five residuals is one standard deviation.
  EXPECT_NEAR(graph.cost(), 2.5, 1e-9);
  EXPECT_NEAR(graph.loops()[0].chi2, 1, 1e-6);
  // Against odometry alone: 0.5 m, with 5 variances of 0.1 m.
  EXPECT_NEAR(*graph.loops()[0].odometry_chi2, 5, 1e-6);
  EXPECT_NEAR(graph.odometry(2)->T_from_to(2, 3), 1, 1e-12);
  EXPECT_NEAR(graph.odometry(2)->covariance(0, 0), 0.01, 1e-12);
}

/// A square of 10 m with a turn of 90 degrees at each corner; the loop has only a direction.
TEST(LoopGraphTest, DirectionAndRotationTurnAStep) {
  LoopGraph graph({.seen_within_m = 1000, .least_position_m = 0, .least_rotation_deg = 0});
  graph.add_keyframe();
  // The heading is uncertain: 5 degrees wrong after the first step.
  graph.add_keyframe({level_pose(0, 0, 5 * std::numbers::pi / 180), diagonal(1e-4, 0.1)});
  graph.add_keyframe({level_pose(0, 10, 0), diagonal(1e-3, 1e-4)});
  // True direction: straight on.
  cv::Matx66d covariance = diagonal(0.001, 0.001);
  covariance(2, 2) = 0;
  graph.add_loop({0, 2, PoseKnown::direction, level_pose(0, 1, 0), covariance});
  graph.solve();
  EXPECT_EQ(graph.loops()[0].verdict, LoopVerdict::kept);
  EXPECT_NEAR(graph.pose(2)(0, 3), 0, 1e-3);
  EXPECT_NEAR(graph.pose(2)(2, 3), 10, 1e-3);
  EXPECT_NEAR(rigid::angle(graph.pose(2)), 0, 1e-4);
}

#ifndef LOOPBIT_SANITIZED  // Ceres' own solver; it takes ten seconds to compile
/// The error of Ceres' pose_graph_3d example, written anew: the translation in the frame of the
/// first pose, and twice the vector of q_measured q_estimated^-1.
struct PlainTerm {
  template <typename T>
  bool operator()(const T* p_a, const T* q_a, const T* p_b, const T* q_b, T* residuals) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    using Quaternion = Eigen::Quaternion<T>;
    const Quaternion back = Eigen::Map<const Quaternion>(q_a).conjugate();
    const Vector3 p = back * (Eigen::Map<const Vector3>(p_b) - Eigen::Map<const Vector3>(p_a));
    const Quaternion turned = back * Eigen::Map<const Quaternion>(q_b);
    const Quaternion error = q.template cast<T>() * turned.conjugate();
    Eigen::Map<Eigen::Matrix<T, 6, 1>> result(residuals);
    result.template head<3>() = p - t.template cast<T>();
    result.template tail<3>() = T(2) * error.vec();
    result.applyOnTheLeft(root.template cast<T>());
    return true;
  }
  Eigen::Vector3d t;
  Eigen::Quaterniond q;
  Eigen::Matrix<double, 6, 6> root;
};

class PlainGraph {
 public:
  explicit PlainGraph(const std::vector<cv::Matx44d>& start) {
    for (const cv::Matx44d& pose : start) {
      positions_.push_back(t_of(pose));
      rotations_.push_back(q_of(pose));
    }
  }

  void add(int a, int b, const cv::Matx44d& T, const cv::Matx66d& covariance) {
    Eigen::Matrix<double, 6, 6> information;
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column < 6; ++column) information(row, column) = covariance(row, column);
    }
    information = information.inverse().eval();
    // The covariance is of a motion in the frame of b; the example's residuals are in that of a.
    Eigen::Matrix<double, 6, 6> turn = Eigen::Matrix<double, 6, 6>::Zero();
    turn.topLeftCorner<3, 3>() = q_of(T).toRotationMatrix();
    turn.bottomRightCorner<3, 3>() = -turn.topLeftCorner<3, 3>();
    information = (turn * information * turn.transpose()).eval();
    const Eigen::Matrix<double, 6, 6> root = information.llt().matrixL().transpose();
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<PlainTerm, 6, 3, 4, 3, 4>(
                                  new PlainTerm{t_of(T), q_of(T), root}),
                              nullptr, at(positions_, a).data(), at(rotations_, a).coeffs().data(),
                              at(positions_, b).data(), at(rotations_, b).coeffs().data());
  }

  double solve() {
    for (Eigen::Quaterniond& rotation : rotations_) {
      problem_.SetManifold(rotation.coeffs().data(), new ceres::EigenQuaternionManifold);
    }
    problem_.SetParameterBlockConstant(positions_[0].data());
    problem_.SetParameterBlockConstant(rotations_[0].coeffs().data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 100;
    options.function_tolerance = 1e-12;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.final_cost;
  }

 private:
  template <typename Value>
  static Value& at(std::vector<Value>& values, int i) {
    return values[static_cast<std::size_t>(i)];
  }
  static Eigen::Vector3d t_of(const cv::Matx44d& T) { return {T(0, 3), T(1, 3), T(2, 3)}; }
  static Eigen::Quaterniond q_of(const cv::Matx44d& T) {
    Eigen::Matrix3d rotation;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) rotation(row, column) = T(row, column);
    }
    return Eigen::Quaterniond(rotation);
  }

  std::vector<Eigen::Vector3d> positions_;
  std::vector<Eigen::Quaterniond> rotations_;
  ceres::Problem problem_;
};
#endif

/// Residuals and their derivatives by small motions of both poses.
struct Linearized {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd derivatives;  ///< 12 columns
};

Linearized linearized(const ceres::CostFunction& cost, const ceres::Manifold& manifold,
                      const std::array<graph::Pose, 2>& poses) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const int size = cost.num_residuals();
  std::array<RowMajor, 2> by{RowMajor(size, 7), RowMajor(size, 7)};
  const std::array<const double*, 2> at{poses[0].data(), poses[1].data()};
  std::array<double*, 2> jacobians{by[0].data(), by[1].data()};
  Linearized result{Eigen::VectorXd(size), Eigen::MatrixXd(size, 12)};
  cost.Evaluate(at.data(), result.residuals.data(), jacobians.data());
  for (int k = 0; k < 2; ++k) {
    const auto i = static_cast<std::size_t>(k);
    Eigen::Matrix<double, 7, 6, Eigen::RowMajor> plus;
    manifold.PlusJacobian(at[i], plus.data());
    result.derivatives.middleCols<6>(6 * k) = by[i] * plus;
  }
  return result;
}

TEST(LoopGraphTest, DerivativesAreRight) {
  Random random;
  const auto random_pose = [&] {
    Eigen::Quaterniond q(random.normal(), random.normal(), random.normal(), random.normal());
    q.normalize();
    return graph::Pose{
        random.normal(), random.normal(), random.normal(), q.x(), q.y(), q.z(), q.w()};
  };
  const ceres::ProductManifold<ceres::EuclideanManifold<3>, ceres::EigenQuaternionManifold>
      manifold;
  for (const PoseKnown known : {PoseKnown::metric, PoseKnown::direction, PoseKnown::nothing}) {
    for (int round = 0; round < 20; ++round) {
      graph::Edge edge{0, 1, known, random_pose(), graph::Matrix6d::Random()};
      edge.information = (edge.information * edge.information.transpose()).eval();
      if (known == PoseKnown::direction) {
        Eigen::Map<Eigen::Vector3d>(edge.measured.data()).normalize();
      }
      const auto cost = graph::cost_function(edge, 2);
      const std::array<graph::Pose, 2> poses{random_pose(), random_pose()};
      const Linearized here = linearized(*cost, manifold, poses);
      for (int column = 0; column < 12; ++column) {
        constexpr double kStep = 1e-6;
        const auto moved = [&](double step) {
          std::array<graph::Pose, 2> result = poses;
          const auto i = static_cast<std::size_t>(column / 6);
          Eigen::Matrix<double, 6, 1> delta = Eigen::Matrix<double, 6, 1>::Zero();
          delta[column % 6] = step;
          manifold.Plus(poses[i].data(), delta.data(), result[i].data());
          return linearized(*cost, manifold, result).residuals;
        };
        const Eigen::VectorXd expected = (moved(kStep) - moved(-kStep)) / (2 * kStep);
        const double error = (here.derivatives.col(column) - expected).norm();
        EXPECT_LE(error, 1e-6 * (1 + expected.norm())) << to_string(known) << ", " << column;
      }
    }
  }
}

TEST(LoopGraphTest, FactorsAreThoseOfTheMatrix) {
  for (const int rank : {3, 5, 6}) {
    for (int round = 0; round < 100; ++round) {
      graph::Matrix6d root = graph::Matrix6d::Random();
      for (int k = rank; k < 6; ++k) root.col(k).setZero();
      const graph::Matrix6d matrix = root * root.transpose();
      const graph::Factors factors(matrix);
      const graph::Matrix6d again = factors.square_root();
      EXPECT_LE((again.transpose() * again - matrix).norm(), rank < 6 ? 1e-7 : 1e-12) << rank;
      if (rank < 6) continue;
      EXPECT_TRUE(factors.are_positive());
      const graph::Matrix6d inverse = matrix.inverse();
      EXPECT_LE((factors.inverse() - inverse).norm(), 1e-9 * inverse.squaredNorm());
      EXPECT_EQ(factors.inverse(), factors.inverse().transpose());
      const graph::Vector6d v = root.col(0);
      EXPECT_NEAR(factors.mahalanobis_sq(v), v.dot(inverse * v), 1e-9 * inverse.norm());
    }
  }
}

#ifndef LOOPBIT_SANITIZED
TEST(LoopGraphTest, CostIsThatOfAPlainPoseGraph) {
  SyntheticGraph synthetic =
      bench::make_synthetic_graph({.keyframes = 200, .loops = 60, .blocks = 3});
  // Covariances of all kinds of correlation, in units of the errors that the loops have.
  Random random;
  for (LoopEdge& loop : synthetic.loops) {
    cv::Matx66d mix = cv::Matx66d::eye();
    for (double& value : mix.val) value += 0.2 * random.normal();
    cv::Matx66d sigma = cv::Matx66d::zeros();
    for (int i = 0; i < 6; ++i) sigma(i, i) = std::sqrt(loop.covariance(i, i));
    loop.covariance = sigma * mix * mix.t() * sigma;
  }
  LoopGraph graph =
      graph_of(synthetic, {.confidence = 0.999999, .least_position_m = 0, .least_rotation_deg = 0});
  graph.solve();
  PlainGraph plain(bench::dead_reckoning(synthetic));
  for (std::size_t k = 0; k < synthetic.odometry.size(); ++k) {
    const int from = static_cast<int>(k);
    plain.add(from, from + 1, synthetic.odometry[k].T_from_to, synthetic.odometry[k].covariance);
  }
  for (const JudgedLoop& loop : graph.loops()) {
    if (loop.verdict != LoopVerdict::kept) continue;
    plain.add(loop.edge.match, loop.edge.query, loop.edge.T_match_query, loop.edge.covariance);
  }
  const double cost = plain.solve();
  const auto kept = std::ranges::count(verdicts_of(graph), LoopVerdict::kept);
  EXPECT_GE(kept, 20);
  EXPECT_GE(static_cast<double>(kept), 0.9 * static_cast<double>(synthetic.loops.size()));
  EXPECT_GT(cost, 10);
  EXPECT_NEAR(graph.cost() / cost, 1, 1e-6);
}
#endif

struct Judged {
  double wrong_kept;  ///< share
  double right_lost;
  double error_m;
};

Judged judged(const LoopGraph& graph, const SyntheticGraph& synthetic) {
  int wrong = 0;
  int wrong_kept = 0;
  int right_lost = 0;
  for (std::size_t i = 0; i < synthetic.loops.size(); ++i) {
    const bool is_kept = graph.loops()[i].verdict == LoopVerdict::kept;
    wrong += synthetic.is_right[i] ? 0 : 1;
    wrong_kept += !synthetic.is_right[i] && is_kept ? 1 : 0;
    right_lost += synthetic.is_right[i] && !is_kept ? 1 : 0;
  }
  const auto right = static_cast<int>(synthetic.loops.size()) - wrong;
  return {wrong == 0 ? 0 : static_cast<double>(wrong_kept) / wrong,
          static_cast<double>(right_lost) / right,
          bench::trajectory_error_m(poses_of(graph), synthetic)};
}

class WrongLoopsTest : public testing::TestWithParam<double> {};

TEST_P(WrongLoopsTest, AreRejected) {
  const SyntheticGraph synthetic = bench::make_synthetic_graph(
      {.keyframes = 1000, .loops = 200, .wrong_share = GetParam(), .blocks = 5});
  LoopGraph graph = graph_of(synthetic);
  graph.solve();
  const Judged result = judged(graph, synthetic);
  EXPECT_LE(result.wrong_kept, 0.01);
  EXPECT_LE(result.right_lost, 0.02);
  EXPECT_LT(result.error_m, 0.5);
  EXPECT_GT(bench::trajectory_error_m(bench::dead_reckoning(synthetic), synthetic), 3);
}

INSTANTIATE_TEST_SUITE_P(Shares, WrongLoopsTest, testing::Values(0, 0.1, 0.3, 0.5));

/// Drift of 30 degrees, and most wrong loops within its reach.
TEST(LoopGraphTest, LongDriveIsSolvedFromRightLoops) {
  const SyntheticGraph synthetic = bench::make_synthetic_graph(
      {.keyframes = 5000, .loops = 1000, .wrong_share = 0.2, .blocks = 14});
  LoopGraph graph = graph_of(synthetic);
  graph.solve();
  const Judged result = judged(graph, synthetic);
  EXPECT_EQ(result.wrong_kept, 0);
  EXPECT_EQ(result.right_lost, 0);
  EXPECT_GT(bench::trajectory_error_m(bench::dead_reckoning(synthetic), synthetic), 10);
  // Nothing better can be had: the same minimum as without wrong loops.
  SyntheticGraph right = synthetic;
  right.loops.clear();
  right.is_right.clear();
  for (std::size_t i = 0; i < synthetic.loops.size(); ++i) {
    if (!synthetic.is_right[i]) continue;
    right.loops.push_back(synthetic.loops[i]);
    right.is_right.push_back(true);
  }
  LoopGraph ideal = graph_of(right);
  ideal.solve();
  EXPECT_NEAR(graph.cost() / ideal.cost(), 1, 1e-6);
  EXPECT_NEAR(result.error_m, judged(ideal, right).error_m, 0.01);
}

/// Loops that no other supports are kept as well.
TEST(LoopGraphTest, LoneLoopsAreKept) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const SyntheticGraph synthetic = bench::make_synthetic_graph(
        {.keyframes = 1000, .loops = 10, .wrong_share = 0.5, .blocks = 5, .seed = seed});
    LoopGraph graph = graph_of(synthetic);
    graph.solve();
    EXPECT_EQ(judged(graph, synthetic).wrong_kept, 0) << seed;
    EXPECT_LE(judged(graph, synthetic).right_lost, 0.1) << seed;
  }
}

TEST(LoopGraphTest, RelaxationOfExactMotionsIsExact) {
  const SyntheticGraph synthetic =
      bench::make_synthetic_graph({.keyframes = 50, .loops = 20, .blocks = 2});
  const auto truth = [&](int k) { return synthetic.truth[static_cast<std::size_t>(k)]; };
  std::vector<graph::WeighedMotion> motions;
  const auto add = [&](int from, int to, double weight) {
    const cv::Matx44d T = rigid::inverse(truth(from)) * truth(to);
    motions.push_back({from, to, graph::pose_of(T), weight, 2 * weight});
  };
  for (int k = 1; k < 50; ++k) add(k - 1, k, 100);
  add(40, 3, 1);
  const std::array fixed{0};
  const auto poses = graph::relaxed_poses(50, motions, fixed);
  for (int k = 0; k < 50; ++k) {
    const cv::Matx44d expected = rigid::inverse(truth(0)) * truth(k);
    EXPECT_LT(cv::norm(graph::matrix_of(poses[static_cast<std::size_t>(k)]) - expected), 1e-6) << k;
  }
}

/// Along a chain, the drift of odometry; over a short cut, less.
TEST(LoopGraphTest, PathCovarianceTakesTheMostCertainPath) {
  std::vector<graph::Pose> poses;
  std::vector<graph::WideLoop> motions;
  const graph::Matrix6d step = graph::eigen_of(diagonal(0.1, 0.01));
  for (int k = 0; k <= 10; ++k) poses.push_back(graph::pose_of(level_pose(0, k, 0)));
  for (int k = 0; k < 10; ++k) motions.push_back({k, k + 1, graph::kIdentity, step});
  const auto chain = graph::PathCovariance(poses, motions).between(2, 7);
  ASSERT_TRUE(chain);
  EXPECT_NEAR((*chain)(2, 2), 5 * 0.01, 1e-12);
  // x of a step back by n metres moves by n times its rotation.
  EXPECT_NEAR((*chain)(0, 0), 5 * 0.01 + 1e-4 * (1 + 4 + 9 + 16), 1e-12);
  motions.push_back({1, 8, graph::kIdentity, step});
  const auto cut = graph::PathCovariance(poses, motions).between(7, 2);
  ASSERT_TRUE(cut);
  EXPECT_NEAR((*cut)(2, 2), 3 * 0.01, 1e-12);
  poses.push_back(graph::kIdentity);
  EXPECT_FALSE(graph::PathCovariance(poses, motions).between(2, 11));
}

TEST(LoopGraphTest, EvidenceNamesTheReason) {
  const auto straight = [](LoopGraph& graph, int steps) {
    graph.add_keyframe();
    for (int k = 0; k < steps; ++k)
      graph.add_keyframe({level_pose(0, 1, 0), diagonal(0.02, 0.002)});
  };
  LoopGraph graph;
  straight(graph, 100);
  graph.add_loop({0, 100, PoseKnown::metric, level_pose(0, 0, 0), diagonal(0.05, 0.005)});
  graph.solve();
  EXPECT_EQ(graph.loops()[0].verdict, LoopVerdict::unreachable);
  EXPECT_GT(*graph.loops()[0].odometry_chi2, graph.loops()[0].limit);

  // One of many loops within reach of drift contradicts all others.
  LoopGraph many;
  straight(many, 100);
  for (int k = 90; k < 100; ++k) {
    const double error = k == 95 ? 0.5 : 0;
    many.add_loop(
        {k - 90, k, PoseKnown::metric, level_pose(0, 90 + error, 0), diagonal(0.02, 0.002)});
  }
  many.solve();
  for (std::size_t i = 0; i < 10; ++i) {
    const JudgedLoop& loop = many.loops()[i];
    EXPECT_EQ(loop.verdict, i == 5 ? LoopVerdict::inconsistent : LoopVerdict::kept) << i;
    EXPECT_EQ(loop.compared, i == 5 ? 9 : 8);
    EXPECT_EQ(loop.agreeing, i == 5 ? 0 : 8);
  }
}

/// Odometry drifts by more than four standard deviations; most loops are just within the limit.
TEST(LoopGraphTest, AMetricLoopBeyondDriftIsKeptWhereOthersPutItToo) {
  LoopGraph graph;
  graph.add_keyframe();
  for (int k = 0; k < 100; ++k) graph.add_keyframe({level_pose(0, 1, 0), diagonal(0.02, 0.002)});
  const auto add = [&](int query, double error_m) {
    const cv::Matx44d pose = level_pose(0, 90 + error_m, 0);
    return graph.add_loop({query - 90, query, PoseKnown::metric, pose, diagonal(0.05, 0.005)});
  };
  for (int query = 90; query < 97; ++query) add(query, 0.85);
  const auto beyond = static_cast<std::size_t>(add(97, 1));
  const auto wrong = static_cast<std::size_t>(add(98, 3));
  EXPECT_GT(*graph.loops()[beyond].odometry_chi2, graph.loops()[beyond].limit);
  graph.solve();
  for (std::size_t i = 0; i <= beyond; ++i) {
    EXPECT_EQ(graph.loops()[i].verdict, LoopVerdict::kept) << i;
  }
  EXPECT_EQ(graph.loops()[wrong].verdict, LoopVerdict::unreachable);
}

TEST(LoopGraphTest, SessionsAreJoinedByLoops) {
  // The second session drives the same curve, from elsewhere.
  LoopGraph graph;
  const cv::Matx44d step = level_pose(0, 1, 0.1);
  const cv::Matx44d start = level_pose(1.5, 0.5, 0.2);
  graph.add_keyframe();
  for (int k = 0; k < 20; ++k) graph.add_keyframe({step, diagonal(0.01, 0.001)});
  const int second = graph.add_keyframe();
  for (int k = 0; k < 20; ++k) graph.add_keyframe({step, diagonal(0.01, 0.001)});
  cv::Matx44d driven = cv::Matx44d::eye();
  for (int k = 0; k <= 20; ++k) {
    if (k == 3 || k == 9 || k == 17) {
      const cv::Matx44d seen = rigid::inverse(driven) * start * driven;
      graph.add_loop({k, second + k, PoseKnown::metric, seen, diagonal(0.05, 0.005)});
    }
    driven = driven * step;
  }
  graph.solve();
  EXPECT_LT(cv::norm(graph.pose(second) - start, cv::NORM_INF), 1e-6);
  EXPECT_FALSE(graph.odometry(second));
  EXPECT_FALSE(graph.loops()[0].odometry_chi2);
  EXPECT_EQ(graph.loops()[0].agreeing, 2);
  EXPECT_EQ(cv::norm(graph.pose(0) - cv::Matx44d::eye(), cv::NORM_INF), 0);
}

TEST(LoopGraphTest, UpdatesFollowTheDriveAndWithstandWrongLoops) {
  const SyntheticGraph synthetic = bench::make_synthetic_graph(
      {.keyframes = 600, .loops = 150, .wrong_share = 0.3, .blocks = 4});
  LoopGraph graph;
  graph.add_keyframe();
  std::size_t next = 0;
  for (int k = 1; k < 600; ++k) {
    graph.add_keyframe(synthetic.odometry[static_cast<std::size_t>(k) - 1]);
    while (next < synthetic.loops.size() && synthetic.loops[next].query == k) {
      graph.add_loop(synthetic.loops[next++]);
    }
    graph.update();
  }
  const Judged driving = judged(graph, synthetic);
  EXPECT_LE(driving.wrong_kept, 0.05);
  EXPECT_LE(driving.right_lost, 0.1);
  EXPECT_LT(driving.error_m, 0.5);
  graph.solve();
  const Judged after = judged(graph, synthetic);
  EXPECT_LE(after.wrong_kept, 0.01);
  EXPECT_LE(after.right_lost, 0.02);
  EXPECT_LE(after.error_m, driving.error_m + 0.05);
}

TEST(LoopGraphTest, SameCallsGiveTheSameBits) {
  const SyntheticGraph synthetic =
      bench::make_synthetic_graph({.keyframes = 300, .loops = 80, .wrong_share = 0.3, .blocks = 3});
  LoopGraph a = graph_of(synthetic);
  LoopGraph b = graph_of(synthetic);
  a.solve();
  b.solve();
  for (int k = 0; k < a.size(); ++k) EXPECT_EQ(a.pose(k), b.pose(k));
  // Solving again changes nothing.
  const auto before = verdicts_of(a);
  a.solve();
  EXPECT_EQ(verdicts_of(a), before);
  EXPECT_EQ(a.pose(200), b.pose(200));
}

TEST(LoopGraphTest, BadInputIsNamed) {
  LoopGraph graph;
  expect_error(ErrorKind::input, {"keyframe 0", "before"}, [&] {
    graph.add_keyframe({level_pose(0, 1, 0), diagonal(0.1, 0.1)});
  });
  graph.add_keyframe();
  expect_error(ErrorKind::input, {"odometry of keyframe 1", "positive definite"}, [&] {
    graph.add_keyframe({level_pose(0, 1, 0), cv::Matx66d::zeros()});
  });
  graph.add_keyframe({level_pose(0, 1, 0), diagonal(0.1, 0.1)});
  expect_error(ErrorKind::input, {"keyframes 2 and 0", "from 0 to 1"}, [&] {
    graph.add_loop({0, 2, PoseKnown::metric, level_pose(0, 0, 0), diagonal(1, 1)});
  });
  expect_error(ErrorKind::input, {"keyframes 1 and 0", "length 1"}, [&] {
    graph.add_loop({0, 1, PoseKnown::direction, level_pose(0, 0, 0), diagonal(1, 1)});
  });
  expect_error(ErrorKind::input, {"keyframes 1 and 0", "positive definite"}, [&] {
    graph.add_loop({0, 1, PoseKnown::metric, level_pose(0, 0, 0), diagonal(-1, 1) * -1.0});
  });
  expect_error(ErrorKind::option, {"graph.window"}, [] { LoopGraph({.window = 0}); });
  EXPECT_TRUE(graph.loops().empty());
  EXPECT_EQ(graph.size(), 2);
}

class G2oFileTest : public ScratchTest {};

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST_F(G2oFileTest, WhatIsWrittenIsReadBackIdentically) {
  SyntheticGraph synthetic =
      bench::make_synthetic_graph({.keyframes = 200, .loops = 40, .wrong_share = 0.3, .blocks = 3});
  synthetic.loops[3].known = PoseKnown::nothing;
  synthetic.loops[4].known = PoseKnown::rotation;
  synthetic.loops[5].known = PoseKnown::direction;
  cv::Matx44d& T = synthetic.loops[5].T_match_query;
  const double length = cv::norm(rigid::translation(T));
  for (int row = 0; row < 3; ++row) T(row, 3) /= length;
  LoopGraph graph = graph_of(synthetic);
  graph.solve();
  write_g2o(path("a.g2o"), graph);
  LoopGraph read = read_g2o(path("a.g2o"));
  write_g2o(path("b.g2o"), read);
  EXPECT_EQ(text_of(path("a.g2o")), text_of(path("b.g2o")));
  ASSERT_EQ(read.size(), graph.size());
  EXPECT_EQ(poses_of(read), poses_of(graph));
  EXPECT_EQ(verdicts_of(read), verdicts_of(graph));
  EXPECT_EQ(read.cost(), graph.cost());
  EXPECT_NE(std::ranges::count(verdicts_of(graph), LoopVerdict::kept), 0);
  EXPECT_LT(std::ranges::count(verdicts_of(graph), LoopVerdict::kept),
            static_cast<int>(graph.loops().size()));
  // And solved alike.
  read.solve();
  EXPECT_EQ(verdicts_of(read), verdicts_of(graph));
}

TEST_F(G2oFileTest, FilesOfOtherProgramsAreRead) {
  const std::string information = " 100 0 0 0 0 0 100 0 0 0 0 100 0 0 0 400 0 0 400 0 400\n";
  const std::string file =
      write("other.g2o",
            "VERTEX_SE3:QUAT 1 0 0 1 0 0 0 1\nVERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n"
            "VERTEX_SE3:QUAT 2 0 0 2 0 0 0 1\nFIX 0\n"
            "EDGE_SE3:QUAT 0 1 0 0 1 0 0 0 1" +
                information + "EDGE_SE3:QUAT 1 2 0 0 1 0 0 0 1" + information +
                "EDGE_SE3:QUAT 0 2 0 0 2.3 0 0 0 1" + information);
  LoopGraph graph = read_g2o(file);
  ASSERT_EQ(graph.loops().size(), 1U);
  EXPECT_EQ(graph.loops()[0].verdict, LoopVerdict::undecided);
  // g2o's information is of half a rotation vector.
  EXPECT_NEAR(graph.odometry(1)->covariance(3, 3), 0.01, 1e-12);
  graph.solve();
  EXPECT_NEAR(graph.pose(2)(2, 3), 2.2, 1e-4);
}

TEST_F(G2oFileTest, DamageIsNamed) {
  expect_error(ErrorKind::input, {"bad.g2o", "line 2"}, [&] {
    read_g2o(write("bad.g2o", "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nEDGE_SE2 0 1 1 0 0\n"));
  });
  expect_error(ErrorKind::input, {"gap.g2o", "without gaps"},
               [&] { read_g2o(write("gap.g2o", "VERTEX_SE3:QUAT 1 0 0 0 0 0 0 1\n")); });
  expect_error(ErrorKind::input, {"turn.g2o", "line 1"},
               [&] { read_g2o(write("turn.g2o", "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 2\n")); });
}

}  // namespace
}  // namespace test
}  // namespace loopbit
