// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "camera_poses.hpp"

namespace loopbit::truth {

/// The poses begin..end - 1 of a sequence.
struct PoseRange {
  std::size_t begin;
  std::size_t end;
};

/// How near two poses must be.
struct PoseLimits {
  double radius_m;
  double heading_deg;  ///< 180 = any

  [[nodiscard]] bool any_heading() const { return heading_deg >= 180.0; }
};

/// Finds the poses of a sequence that are near one, as ranges. Stretches of poses that stay within
/// the radius are kept in a grid, and blocks of 2, 4, 8... successive poses have bounds, so that
/// most poses are found or passed over many at a time: a camera that stands still costs a query
/// the logarithm of its poses. The answers are those of a test of each single pose.
class NearbyPoses {
 public:
  /// `largest`: at least the limits of any query.
  NearbyPoses(std::vector<CameraPose> poses, PoseLimits largest);

  [[nodiscard]] const std::vector<CameraPose>& poses() const { return poses_; }

  /// Appends to `found` all of the first `end` poses that are near `query`, in no order; no pose
  /// twice.
  void find(const CameraPose& query, PoseLimits limits, std::size_t end,
            std::vector<PoseRange>& found) const;

 private:
  using Cell = std::array<std::int64_t, 3>;

  struct CellHash {
    std::size_t operator()(const Cell& cell) const;
  };

  /// How far the poses of a block are from its middle one, at most.
  struct Bounds {
    double reach_m = 0.0;
    double spread_deg = 0.0;
  };

  enum class Verdict { near, far, mixed };

  void add_bounds(bool with_headings);
  void add_stretches();
  [[nodiscard]] Cell cell(const cv::Vec3d& position_m) const;
  /// Of the block of 2^level poses from `begin`.
  [[nodiscard]] static std::size_t middle(std::size_t begin, std::size_t level);
  [[nodiscard]] Verdict judge(const CameraPose& query, const PoseLimits& limits, std::size_t begin,
                              std::size_t level) const;
  void find_in(const CameraPose& query, const PoseLimits& limits, PoseRange range,
               std::vector<PoseRange>& found) const;

  std::vector<CameraPose> poses_;
  double stretch_m_;                         ///< how far a stretch reaches from its first pose
  double side_m_;                            ///< of a cell
  std::vector<std::vector<Bounds>> bounds_;  ///< by level; level 0, single poses, has none
  std::unordered_map<Cell, std::vector<PoseRange>, CellHash> stretches_;  ///< by their first pose
};

}  // namespace loopbit::truth
