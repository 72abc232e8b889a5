// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string_view>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/odometry.hpp"
#include "loopbit/options.hpp"
#include "loopbit/relative_pose.hpp"

namespace loopbit {

/// The verdict of a LoopGraph on a loop, and the evidence for it.
enum class LoopVerdict {
  undecided,     ///< not solved yet, or it waits for a second loop that agrees
  kept,          ///< it is part of the solution
  unreachable,   ///< odometry alone says that the camera cannot have got there
  inconsistent,  ///< most loops nearby contradict it
  outlier,       ///< it contradicts the solution
};

inline constexpr std::array kAllLoopVerdicts{LoopVerdict::undecided, LoopVerdict::kept,
                                             LoopVerdict::unreachable, LoopVerdict::inconsistent,
                                             LoopVerdict::outlier};

/// The enumerator's name.
std::string_view to_string(LoopVerdict verdict);

/// A loop between two keyframes.
struct LoopEdge {
  int match = 0;  ///< a keyframe
  int query = 0;  ///< another keyframe
  /// What is known of T_match_query: all of it (metric), rotation and direction of the translation
  /// (direction), the rotation, or nothing but that both see the same place.
  PoseKnown known = PoseKnown::metric;
  /// x_match = T_match_query x_query. Conventions, units and covariance as in RelativePose.
  cv::Matx44d T_match_query = cv::Matx44d::eye();
  cv::Matx66d covariance = cv::Matx66d::zeros();
};

/// The loop of a measured relative pose.
LoopEdge loop_edge(int match, int query, const RelativePose& pose);

/// A loop with its verdict and the evidence.
struct JudgedLoop {
  LoopEdge edge;
  LoopVerdict verdict = LoopVerdict::undecided;
  /// Squared Mahalanobis distance from what odometry alone says. None if odometry does not connect
  /// the two keyframes.
  std::optional<double> odometry_chi2 = std::nullopt;
  int compared = 0;  ///< loops nearby that it was compared with
  int agreeing = 0;  ///< those of them that agree with it
  double chi2 = 0;   ///< squared residual in units of its covariance, in the solution
  double limit = 0;  ///< largest odometry_chi2 or chi2 that is not a contradiction
};

struct LoopGraphOptions {
  double confidence = 0.999;
  double seen_within_m = 3.0;
  double least_position_m = 0.03;
  double least_rotation_deg = 0.3;
  int window = 30;

  static constexpr auto fields() {
    using S = LoopGraphOptions;
    return std::tuple{
        Field{"confidence", &S::confidence, 0.5, 0.999999,
              "share of right loops that pass each test, if all covariances are right"},
        Field{"seen_within_m", &S::seen_within_m, 0.01, 1000.0,
              "standard deviation of the distance between the cameras of a loop without a length, "
              "per axis, m"},
        Field{"least_position_m", &S::least_position_m, 0.0, 100.0,
              "added to the standard deviation of a loop's position (a calibration has errors, "
              "too), m"},
        Field{"least_rotation_deg", &S::least_rotation_deg, 0.0, 90.0,
              "added to the standard deviation of a loop's rotation, degrees"},
        Field{"window", &S::window, 2, 100'000,
              "keyframes that update() solves for, and all since the last loop"}};
  }
};

/// A pose graph: keyframes joined by odometry and loops. It tells right loops from wrong ones, and
/// corrects the trajectory.
///
/// solve() is the batch: loops that odometry makes impossible are rejected, then those that most
/// loops nearby contradict (pairwise consistency; Mangelson et al. 2018), and the rest is solved by
/// graduated non-convexity with a truncated least squares loss (Yang et al. 2020) on Ceres.
/// update() is for a robot that drives: it solves the latest keyframes only, and everything only if
/// loops demand it. Not thread-safe. The same calls give the same answers.
class LoopGraph {
 public:
  /// Throws Error (kind option) if `options` are not valid.
  explicit LoopGraph(const LoopGraphOptions& options = {});
  ~LoopGraph();
  LoopGraph(const LoopGraph&) = delete;
  LoopGraph& operator=(const LoopGraph&) = delete;
  LoopGraph(LoopGraph&&) noexcept;
  LoopGraph& operator=(LoopGraph&&) noexcept;

  /// Adds a keyframe that odometry does not connect to the one before: the first of all, or the
  /// first of another session. Only loops connect it. Returns its number, from 0.
  int add_keyframe();

  /// Adds a keyframe. `motion`: since the keyframe before, with T_from_to from that one to the new
  /// one. Returns its number. Throws Error (kind input) if there is no keyframe before, the
  /// motion is not rigid, or the covariance is not positive definite.
  int add_keyframe(const Motion& motion);

  /// Adds a loop. Returns its number, from 0. Throws Error (kind input) if a keyframe does not
  /// exist, both are the same, the pose is not rigid, or the covariance does not fit `known`.
  int add_loop(const LoopEdge& loop);

  /// Judges new loops and solves the latest keyframes; the whole graph if loops that agree with
  /// each other contradict the estimate. Cost: see docs/graph.md.
  void update();

  /// Judges all loops anew and solves the whole graph, from odometry on.
  void solve();

  /// Number of keyframes.
  [[nodiscard]] int size() const;

  /// The pose of a keyframe: x_world = T_world_keyframe x_keyframe; see worlds().
  [[nodiscard]] cv::Matx44d pose(int keyframe) const;

  /// For each keyframe, the one that is the world of its pose(): the first that odometry and kept
  /// loops connect it to.
  [[nodiscard]] std::vector<int> worlds() const;

  /// The motion that odometry gave between the keyframe before and this one. None if there is none.
  [[nodiscard]] std::optional<Motion> odometry(int keyframe) const;

  /// All loops, by their numbers.
  [[nodiscard]] const std::vector<JudgedLoop>& loops() const;

  /// Half the sum of the squared residuals of odometry and kept loops, as Ceres counts cost.
  [[nodiscard]] double cost() const;

 private:
  friend class G2oFile;
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loopbit
