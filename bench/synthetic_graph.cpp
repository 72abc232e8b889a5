// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "synthetic_graph.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>

#include "loopbit/rigid_motion.hpp"
#include "loopbit/trajectory_error.hpp"

namespace loopbit::bench {
namespace {

constexpr double kRadians = std::numbers::pi / 180;
constexpr int kBlock_m = 10;
constexpr double kLoopError_m = 0.05;
constexpr double kLoopError = 0.3 * kRadians;

/// Numbers that are the same on every machine.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : engine_(seed) {}
  int below(int end) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(end)); }
  double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }
  double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }
  cv::Vec3d normals(double sigma) { return {sigma * normal(), sigma * normal(), sigma * normal()}; }

 private:
  std::mt19937_64 engine_;
};

cv::Matx44d rigid_motion(const cv::Vec3d& turn, const cv::Vec3d& t) {
  const double angle = cv::norm(turn);
  const cv::Vec3d axis = angle > 0 ? turn / angle : cv::Vec3d(1, 0, 0);
  const cv::Matx33d cross(0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0);
  const cv::Matx33d r =
      cv::Matx33d::eye() + std::sin(angle) * cross + (1 - std::cos(angle)) * (cross * cross);
  return {r(0, 0), r(0, 1), r(0, 2), t[0], r(1, 0), r(1, 1), r(1, 2), t[1],
          r(2, 0), r(2, 1), r(2, 2), t[2], 0,       0,       0,       1};
}

/// Streets run along x and z; the camera looks ahead.
std::vector<cv::Matx44d> drive(const SyntheticGraphOptions& options, Chance& chance) {
  static const std::array<cv::Point, 4> kAhead{{{0, 1}, {1, 0}, {0, -1}, {-1, 0}}};
  std::vector<cv::Matx44d> poses;
  cv::Point block(0, 0);
  int heading = 0;
  const cv::Rect town(0, 0, options.blocks + 1, options.blocks + 1);
  while (static_cast<int>(poses.size()) < options.keyframes) {
    const cv::Point ahead = kAhead[static_cast<std::size_t>(heading)];
    for (int step = 0; step < kBlock_m && static_cast<int>(poses.size()) < options.keyframes;
         ++step) {
      const cv::Point at = block * kBlock_m + ahead * step;
      poses.push_back(
          rigid_motion({0, heading * std::numbers::pi / 2, 0},
                       {at.x + 0.1 * chance.normal(), 0, at.y + 0.1 * chance.normal()}));
    }
    block += ahead;
    int next = heading;
    do {
      next = (heading + std::array{0, 1, 3}[static_cast<std::size_t>(chance.below(3))]) % 4;
    } while (!town.contains(block + kAhead[static_cast<std::size_t>(next)]));
    heading = next;
  }
  return poses;
}

std::vector<Motion> odometry_of(const std::vector<cv::Matx44d>& truth, const OdometryDrift& drift,
                                Chance& chance) {
  std::vector<Motion> odometry;
  cv::Vec3d bias;
  cv::Vec3d bias_turn;
  double until_m = 0;
  for (std::size_t k = 1; k < truth.size(); ++k) {
    const cv::Matx44d step = rigid::inverse(truth[k - 1]) * truth[k];
    const double distance_m = cv::norm(rigid::translation(step));
    if (until_m <= 0) {
      bias = chance.normals(drift.position_per_m);
      bias_turn = chance.normals(drift.rotation_deg_per_m * kRadians);
      until_m = drift.correlated_m;
    }
    until_m -= distance_m;
    const double turned = rigid::angle(step);
    const cv::Vec3d turn = bias_turn * distance_m + chance.normals(drift.rotation_per_rad * turned);
    odometry.push_back(
        {step * rigid_motion(turn, bias * distance_m), drift_covariance(step, drift)});
  }
  return odometry;
}

LoopEdge loop_between(int match, int query, const cv::Matx44d& T_match_query) {
  LoopEdge loop{match, query, PoseKnown::metric, T_match_query, cv::Matx66d::eye()};
  for (int i = 0; i < 6; ++i) {
    loop.covariance(i, i) = i < 3 ? kLoopError_m * kLoopError_m : kLoopError * kLoopError;
  }
  return loop;
}

/// Each keyframe with the first one that was at the same crossing of metres, heading alike.
std::vector<std::pair<int, int>> revisits(const std::vector<cv::Matx44d>& truth) {
  constexpr int kLeastGap = 30;
  std::map<std::array<int, 3>, std::vector<int>> seen;
  std::vector<std::pair<int, int>> found;
  for (int k = 0; k < static_cast<int>(truth.size()); ++k) {
    const cv::Matx44d& pose = truth[static_cast<std::size_t>(k)];
    const std::array<int, 3> cell{static_cast<int>(std::lround(pose(0, 3))),
                                  static_cast<int>(std::lround(pose(2, 3))),
                                  static_cast<int>(std::lround(2 * pose(0, 2) + pose(0, 0)))};
    auto& before = seen[cell];
    if (!before.empty() && k - before.back() > kLeastGap) found.emplace_back(before.back(), k);
    before.push_back(k);
  }
  return found;
}

}  // namespace

SyntheticGraph make_synthetic_graph(const SyntheticGraphOptions& options) {
  Chance chance(options.seed);
  SyntheticGraph graph;
  graph.truth = drive(options, chance);
  graph.odometry = odometry_of(graph.truth, options.drift, chance);
  std::vector<std::pair<LoopEdge, bool>> loops;
  auto right = revisits(graph.truth);
  while (static_cast<int>(right.size()) > options.loops) {
    right.erase(right.begin() + chance.below(static_cast<int>(right.size())));
  }
  for (const auto& [match, query] : right) {
    const cv::Matx44d T = rigid::inverse(graph.truth[static_cast<std::size_t>(match)]) *
                          graph.truth[static_cast<std::size_t>(query)];
    const cv::Matx44d error =
        rigid_motion(chance.normals(kLoopError), chance.normals(kLoopError_m));
    loops.emplace_back(loop_between(match, query, T * error), true);
  }
  const auto wrong = static_cast<int>(std::lround(static_cast<double>(right.size()) *
                                                  options.wrong_share / (1 - options.wrong_share)));
  for (int i = 0; i < wrong;) {
    const int query = 1 + chance.below(options.keyframes - 1);
    const int match = chance.below(query);
    const cv::Matx44d T = rigid::inverse(graph.truth[static_cast<std::size_t>(match)]) *
                          graph.truth[static_cast<std::size_t>(query)];
    constexpr double kElsewhere_m = 5;
    if (cv::norm(rigid::translation(T)) < kElsewhere_m) continue;
    loops.emplace_back(
        loop_between(match, query, rigid_motion(chance.normals(0.05), chance.normals(0.2))), false);
    ++i;
  }
  std::ranges::stable_sort(loops, {}, [](const auto& loop) { return loop.first.query; });
  for (const auto& [loop, is_right] : loops) {
    graph.loops.push_back(loop);
    graph.is_right.push_back(is_right);
  }
  return graph;
}

double trajectory_error_m(const std::vector<cv::Matx44d>& poses, const SyntheticGraph& graph) {
  std::vector<cv::Vec3d> positions;
  std::vector<cv::Vec3d> truth;
  for (const cv::Matx44d& pose : poses) positions.push_back(rigid::translation(pose));
  for (const cv::Matx44d& pose : graph.truth) truth.push_back(rigid::translation(pose));
  return absolute_trajectory_error_m(positions, truth);
}

std::vector<cv::Matx44d> dead_reckoning(const SyntheticGraph& graph) {
  std::vector<cv::Matx44d> poses{cv::Matx44d::eye()};
  for (const Motion& motion : graph.odometry) poses.push_back(poses.back() * motion.T_from_to);
  return poses;
}

}  // namespace loopbit::bench
