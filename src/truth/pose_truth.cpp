// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "loopbit/error.hpp"

#include "camera_poses.hpp"
#include "nearby_poses.hpp"
#include "truth_rows.hpp"

namespace loopbit {
namespace {

using Poses = std::vector<std::optional<CameraPose>>;

/// Beyond, whole cells could no longer be told apart at the smallest radius.
constexpr double kMaxCoordinate_m = 1e9;

/// 60 MB. A drive has a few for each frame.
constexpr std::size_t kMaxRuns = 5'000'000;

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

/// The frames whose poses are known, in order.
std::vector<int> known_frames(const Poses& poses) {
  std::vector<int> known;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!poses[i]) continue;
    known.push_back(static_cast<int>(i));
    check(*poses[i], known.back());
  }
  return known;
}

std::vector<CameraPose> poses_of(const Poses& poses, const std::vector<int>& frames) {
  std::vector<CameraPose> found;
  found.reserve(frames.size());
  for (const int frame : frames) found.push_back(*poses[static_cast<std::size_t>(frame)]);
  return found;
}

class PoseTruth {
 public:
  PoseTruth(const Poses& poses, const PoseTruthOptions& options)
      : options_(options),
        path_m_(path_lengths_m(poses)),
        known_(known_frames(poses)),
        unbroken_(known_.size()),
        nearby_(poses_of(poses, known_),
                {std::max(options.radius_m, options.grey_radius_m), options.max_heading_deg}) {
    for (std::size_t i = known_.size(); i-- > 0;) {
      const bool goes_on = i + 1 < known_.size() && known_[i + 1] == known_[i] + 1;
      unbroken_[i] = goes_on ? unbroken_[i + 1] : i + 1;
    }
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (!poses[i]) truth_.unknown.push_back(static_cast<int>(i));
    }
  }

  GroundTruth find() {
    std::size_t end = 0;  // of the poses that gap and path allow; it never goes back
    for (std::size_t query = 0; query < known_.size(); ++query) {
      while (end < query && is_long_ago(query, end)) ++end;
      find_places(query, end);
    }
    return std::move(truth_);
  }

 private:
  using PoseRange = truth::PoseRange;

  [[nodiscard]] bool is_long_ago(std::size_t query, std::size_t place) const {
    const auto path_m = [&](std::size_t i) { return path_m_[static_cast<std::size_t>(known_[i])]; };
    return known_[query] - known_[place] > options_.min_gap_frames &&
           path_m(query) - path_m(place) >= options_.min_path_m;
  }

  void find_places(std::size_t query, std::size_t end) {
    constexpr double kAnyHeading_deg = 180.0;
    const CameraPose& pose = nearby_.poses()[query];
    found_.clear();
    nearby_.find(pose, {options_.radius_m, options_.max_heading_deg}, end, found_);
    add_found(query, truth_.same_place);
    if (options_.grey_radius_m == 0.0) return;
    nearby_.find(pose, {options_.grey_radius_m, kAnyHeading_deg}, query, found_);
    add_found(query, truth_.near_place);
  }

  /// What was found may overlap.
  void add_found(std::size_t query, std::vector<PlaceRun>& runs) {
    std::ranges::sort(found_, {}, &PoseRange::begin);
    std::size_t begin = 0;
    for (const PoseRange& range : found_) {
      begin = std::max(begin, range.begin);
      while (begin < range.end) {
        const std::size_t end = std::min(range.end, unbroken_[begin]);
        truth::add_places(runs, {known_[query], known_[begin], known_[end - 1]});
        begin = end;
      }
    }
    if (runs.size() <= kMaxRuns) return;
    throw Error(ErrorKind::input,
                fmt::format("Up to frame {0} of {1}, the poses give more than {2} ranges of true "
                            "places, since the camera goes back and forth between places all the "
                            "time. Give the poses of fewer frames.",
                            known_[query], path_m_.size(), kMaxRuns));
  }

  const PoseTruthOptions& options_;
  std::vector<double> path_m_;  ///< by frame
  // Of the frames whose poses are known, one after the other:
  std::vector<int> known_;             ///< their numbers
  std::vector<std::size_t> unbroken_;  ///< up to where frames follow each other
  truth::NearbyPoses nearby_;
  GroundTruth truth_;
  std::vector<PoseRange> found_;  ///< of the present query
};

}  // namespace

GroundTruth truth_from_poses(const std::vector<std::optional<CameraPose>>& poses,
                             const PoseTruthOptions& options) {
  validate(options, "poses");
  return PoseTruth(poses, options).find();
}

}  // namespace loopbit
