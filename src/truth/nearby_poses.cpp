// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "nearby_poses.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace loopbit::truth {
namespace {

// What is nearer to a limit than rounding may move it is left to the test of single poses.
constexpr double kDistanceMargin = 1e-9;  // relative
constexpr double kHeadingMargin_deg = 1e-6;

double angle_deg(const cv::Vec3d& a, const cv::Vec3d& b) {
  return std::atan2(cv::norm(a.cross(b)), a.dot(b)) * 180.0 / CV_PI;
}

double distance_m(const CameraPose& a, const CameraPose& b) {
  return cv::norm(a.position_m - b.position_m);
}

/// Of the angles of others, those to what is no direction say nothing.
double spread_deg(const cv::Vec3d& a, const cv::Vec3d& b) {
  const auto is_direction = [](const cv::Vec3d& v) { return std::abs(cv::norm(v) - 1.0) < 0.5; };
  if (a == b) return 0.0;
  if (!is_direction(a) || !is_direction(b)) return std::numeric_limits<double>::infinity();
  return angle_deg(a, b);
}

}  // namespace

std::size_t NearbyPoses::CellHash::operator()(const Cell& cell) const {
  std::uint64_t hash = 0;
  for (const std::int64_t i : cell) {  // the multiplier of Knuth's MMIX generator
    hash = (hash ^ static_cast<std::uint64_t>(i)) * 6364136223846793005U;
    hash ^= hash >> 32U;
  }
  return hash;
}

NearbyPoses::NearbyPoses(std::vector<CameraPose> poses, PoseLimits largest)
    : poses_(std::move(poses)),
      stretch_m_(largest.radius_m),
      // A little larger: rounding must not move what is in reach beyond the next cell.
      side_m_(1.001 * (largest.radius_m + stretch_m_)) {
  add_bounds(!largest.any_heading());
  add_stretches();
}

std::size_t NearbyPoses::middle(std::size_t begin, std::size_t level) {
  return begin + (std::size_t{1} << level) / 2;
}

void NearbyPoses::add_bounds(bool with_headings) {
  bounds_.emplace_back();
  for (std::size_t level = 1; std::size_t{1} << level <= poses_.size(); ++level) {
    const std::size_t size = std::size_t{1} << level;
    std::vector<Bounds>& blocks = bounds_.emplace_back(poses_.size() / size);  // whole ones only
    for (std::size_t i = 0; i < blocks.size() * size; ++i) {
      const CameraPose& central = poses_[middle(i / size * size, level)];
      Bounds& block = blocks[i / size];
      block.reach_m = std::max(block.reach_m, distance_m(poses_[i], central));
      if (!with_headings) continue;
      block.spread_deg = std::max(block.spread_deg, spread_deg(poses_[i].ahead, central.ahead));
    }
  }
}

void NearbyPoses::add_stretches() {
  for (std::size_t begin = 0, end = 0; begin < poses_.size(); begin = end) {
    while (end < poses_.size() && distance_m(poses_[end], poses_[begin]) <= stretch_m_) ++end;
    stretches_[cell(poses_[begin].position_m)].push_back({begin, end});
  }
}

NearbyPoses::Cell NearbyPoses::cell(const cv::Vec3d& position_m) const {
  Cell cell{};
  for (std::size_t i = 0; i < cell.size(); ++i) {
    cell[i] = static_cast<std::int64_t>(std::floor(position_m[static_cast<int>(i)] / side_m_));
  }
  return cell;
}

void NearbyPoses::find(const CameraPose& query, PoseLimits limits, std::size_t end,
                       std::vector<PoseRange>& found) const {
  const Cell center = cell(query.position_m);
  const double farthest_m = (limits.radius_m + stretch_m_) * (1.0 + kDistanceMargin);
  for (std::int64_t i = 0; i < 27; ++i) {
    const auto stretches =
        stretches_.find({center[0] + i % 3 - 1, center[1] + i / 3 % 3 - 1, center[2] + i / 9 - 1});
    if (stretches == stretches_.end()) continue;
    for (const PoseRange& stretch : stretches->second) {
      if (stretch.begin >= end) break;
      if (distance_m(query, poses_[stretch.begin]) > farthest_m) continue;
      find_in(query, limits, {stretch.begin, std::min(stretch.end, end)}, found);
    }
  }
}

void NearbyPoses::find_in(const CameraPose& query, const PoseLimits& limits, PoseRange range,
                          std::vector<PoseRange>& found) const {
  const std::size_t first_found = found.size();
  for (std::size_t begin = range.begin; begin < range.end;) {
    // The largest block that begins here, and then ever smaller ones.
    auto level = static_cast<std::size_t>(std::bit_width(range.end - begin) - 1);
    if (begin != 0) level = std::min(level, static_cast<std::size_t>(std::countr_zero(begin)));
    Verdict verdict = judge(query, limits, begin, level);
    while (verdict == Verdict::mixed) verdict = judge(query, limits, begin, --level);
    const std::size_t end = begin + (std::size_t{1} << level);
    if (verdict == Verdict::near) {
      if (found.size() > first_found && found.back().end == begin) {
        found.back().end = end;
      } else {
        found.push_back({begin, end});
      }
    }
    begin = end;
  }
}

NearbyPoses::Verdict NearbyPoses::judge(const CameraPose& query, const PoseLimits& limits,
                                        std::size_t begin, std::size_t level) const {
  const CameraPose& central = poses_[middle(begin, level)];
  const Bounds bounds = level == 0 ? Bounds{} : bounds_[level][begin >> level];
  const double from_m = distance_m(query, central);
  if (from_m - bounds.reach_m > limits.radius_m * (1.0 + kDistanceMargin)) return Verdict::far;
  const double turned_deg = limits.any_heading() ? 0.0 : angle_deg(query.ahead, central.ahead);
  if (bounds.reach_m == 0.0 && bounds.spread_deg == 0.0) {  // one pose, or all the same
    const bool is_near = from_m <= limits.radius_m && turned_deg <= limits.heading_deg;
    return is_near ? Verdict::near : Verdict::far;
  }
  if (turned_deg - bounds.spread_deg > limits.heading_deg + kHeadingMargin_deg) return Verdict::far;
  const bool all_near = from_m + bounds.reach_m <= limits.radius_m * (1.0 - kDistanceMargin) &&
                        (limits.any_heading() ||
                         turned_deg + bounds.spread_deg <= limits.heading_deg - kHeadingMargin_deg);
  return all_near ? Verdict::near : Verdict::mixed;
}

}  // namespace loopbit::truth
