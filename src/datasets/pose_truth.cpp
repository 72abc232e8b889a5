// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <unordered_map>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "loopbit/error.hpp"
#include "loopbit/poses.hpp"

#include "place_runs.hpp"

namespace loopbit {
namespace {

using Poses = std::vector<std::optional<CameraPose>>;

/// Beyond, whole cells could no longer be told apart at the smallest radius.
constexpr double kMaxCoordinate_m = 1e9;

/// Frames by where they are, in cubes.
class Grid {
 public:
  /// Cubes are a little larger than `reach_m`: rounding must not move what is in reach beyond the
  /// next cube.
  explicit Grid(double reach_m) : side_m_(1.001 * reach_m) {}

  void add(int frame, const cv::Vec3d& position_m) { frames_[cell(position_m)].push_back(frame); }

  /// Calls visit(frame) for all frames within reach of `position_m`, and some beyond.
  template <typename Visit>
  void for_each_near(const cv::Vec3d& position_m, Visit visit) const {
    const Cell middle = cell(position_m);
    for (std::int64_t i = 0; i < 27; ++i) {
      const auto found =
          frames_.find({middle[0] + i % 3 - 1, middle[1] + i / 3 % 3 - 1, middle[2] + i / 9 - 1});
      if (found == frames_.end()) continue;
      for (const int frame : found->second) visit(frame);
    }
  }

 private:
  using Cell = std::array<std::int64_t, 3>;

  struct Hash {
    std::size_t operator()(const Cell& cell) const {
      std::uint64_t hash = 0;
      for (const std::int64_t i : cell) {  // the multiplier of Knuth's MMIX generator
        hash = (hash ^ static_cast<std::uint64_t>(i)) * 6364136223846793005U;
        hash ^= hash >> 32U;
      }
      return hash;
    }
  };

  [[nodiscard]] Cell cell(const cv::Vec3d& position_m) const {
    Cell cell{};
    for (std::size_t i = 0; i < cell.size(); ++i) {
      cell[i] = static_cast<std::int64_t>(std::floor(position_m[static_cast<int>(i)] / side_m_));
    }
    return cell;
  }

  double side_m_;
  std::unordered_map<Cell, std::vector<int>, Hash> frames_;
};

double angle_deg(const cv::Vec3d& a, const cv::Vec3d& b) {
  return std::atan2(cv::norm(a.cross(b)), a.dot(b)) * 180.0 / CV_PI;
}

/// How far the camera has come at each frame; it stays where it was while its pose is not known.
std::vector<double> path_lengths_m(const Poses& poses) {
  std::vector<double> lengths_m;
  lengths_m.reserve(poses.size());
  double length_m = 0.0;
  const CameraPose* last = nullptr;
  for (const auto& pose : poses) {
    if (pose && last != nullptr) length_m += cv::norm(pose->position_m - last->position_m);
    if (pose) last = &*pose;
    lengths_m.push_back(length_m);
  }
  return lengths_m;
}

void check(const CameraPose& pose, int frame) {
  for (int i = 0; i < 3; ++i) {
    const bool in_reach = std::abs(pose.position_m[i]) <= kMaxCoordinate_m;
    if (in_reach && std::isfinite(pose.ahead[i])) continue;
    throw Error(ErrorKind::input,
                fmt::format("The pose of frame {} is not finite or further than {} m from the "
                            "origin: correct it or leave it out.",
                            frame, kMaxCoordinate_m));
  }
}

class PoseTruth {
 public:
  PoseTruth(const Poses& poses, const PoseTruthOptions& options)
      : poses_(poses),
        options_(options),
        path_m_(path_lengths_m(poses)),
        grid_(std::max(options.radius_m, options.grey_radius_m)) {}

  GroundTruth find() {
    for (int query = 0; query < static_cast<int>(poses_.size()); ++query) {
      if (!poses_[static_cast<std::size_t>(query)]) {
        truth_.unknown.push_back(query);
        continue;
      }
      check(pose(query), query);
      find_places(query);
      grid_.add(query, pose(query).position_m);
    }
    return std::move(truth_);
  }

 private:
  [[nodiscard]] const CameraPose& pose(int frame) const {
    return *poses_[static_cast<std::size_t>(frame)];
  }

  /// Nearest tests first; `distance_m` is theirs.
  [[nodiscard]] bool is_same_place(int query, int place, double distance_m) const {
    const auto path_m = [&](int frame) { return path_m_[static_cast<std::size_t>(frame)]; };
    return distance_m <= options_.radius_m && query - place > options_.min_gap_frames &&
           path_m(query) - path_m(place) >= options_.min_path_m &&
           angle_deg(pose(query).ahead, pose(place).ahead) <= options_.max_heading_deg;
  }

  void find_places(int query) {
    same_.clear();
    near_.clear();
    grid_.for_each_near(pose(query).position_m, [&](int place) {
      const double distance_m = cv::norm(pose(query).position_m - pose(place).position_m);
      const bool is_same = is_same_place(query, place, distance_m);
      if (is_same) same_.push_back(place);
      if (distance_m <= options_.grey_radius_m || is_same) near_.push_back(place);
    });
    if (options_.grey_radius_m == 0.0) near_.clear();
    add(query, same_, truth_.same_place);
    add(query, near_, truth_.near_place);
  }

  static void add(int query, std::vector<int>& places, std::vector<PlaceRun>& runs) {
    std::ranges::sort(places);
    for (const int place : places) datasets::add_place(runs, query, place);
  }

  const Poses& poses_;
  const PoseTruthOptions& options_;
  std::vector<double> path_m_;
  Grid grid_;
  GroundTruth truth_;
  std::vector<int> same_;  ///< of the present query
  std::vector<int> near_;
};

}  // namespace

GroundTruth truth_from_poses(const std::vector<std::optional<CameraPose>>& poses,
                             const PoseTruthOptions& options) {
  validate(options, "poses");
  return PoseTruth(poses, options).find();
}

}  // namespace loopbit
