// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>

#include "graph_data.hpp"

namespace loopbit::graph {

/// The squared residual of an edge, in units of its covariance. `seen_within_m`: see
/// LoopGraphOptions; for edges without a length.
double chi2_of(const Edge& edge, const Pose& from, const Pose& to, double seen_within_m);

/// The residuals behind it, as a function of both poses.
std::unique_ptr<ceres::CostFunction> cost_function(const Edge& edge, double seen_within_m);

/// The number of independent residuals behind chi2_of().
int freedom_of(PoseKnown known);

/// A pose graph in Ceres. Poses are varied in place.
class PoseProblem {
 public:
  PoseProblem(std::vector<Pose>& poses, double seen_within_m);

  void add(const Edge& edge, double weight = 1);
  /// Its residuals count `weight` times from the next solve() on. Edges by the order of add().
  /// An edge of weight 0 costs nothing.
  void set_weight(std::size_t edge, double weight);
  /// Only if an edge has the keyframe.
  void fix(int keyframe);
  /// Levenberg-Marquardt with sparse Cholesky factors. Returns the cost.
  double solve(int max_iterations);

 private:
  /// A factor that may change between solves.
  struct WeightLoss final : ceres::LossFunction {
    void Evaluate(double squared, double* rho) const override {
      rho[0] = weight * squared;
      rho[1] = weight;
      rho[2] = 0;
    }
    double weight = 0;
  };
  struct Term {
    double* from = nullptr;
    double* to = nullptr;
    std::unique_ptr<ceres::CostFunction> cost;
    WeightLoss loss{};
    ceres::ResidualBlockId block = nullptr;  ///< none while the weight is 0
  };

  static ceres::Problem::Options problem_options();

  std::vector<Pose>& poses_;
  double seen_within_m_;
  std::unique_ptr<ceres::Manifold> manifold_;
  std::deque<Term> terms_;
  ceres::Problem problem_;
};

}  // namespace loopbit::graph
