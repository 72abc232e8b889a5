// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "loopbit/finished_run.hpp"
#include "loopbit/rigid_motion.hpp"
#include "loopbit/run_record.hpp"

namespace loopbit {
namespace {

constexpr int kLeast = 10;  ///< frames or loops that say something

/// The motion of odometry to a frame from the one before that has odometry.
struct Step {
  PlaceId from = 0;
  PlaceId to = 0;
  double distance_m = 0;
  double duration = 0;  ///< seconds, or frames if there are no times

  [[nodiscard]] double speed() const { return distance_m / duration; }
};

std::vector<Step> steps_of(const std::vector<Detection>& detections) {
  std::vector<Step> steps;
  const Detection* before = nullptr;
  for (const Detection& detection : detections) {
    if (!detection.odometry) continue;
    if (before != nullptr) {
      const cv::Vec3d moved = rigid::translation(detection.odometry->T_odometry_camera) -
                              rigid::translation(before->odometry->T_odometry_camera);
      auto duration = static_cast<double>(detection.frame - before->frame);
      if (detection.timestamp_s && before->timestamp_s &&
          *detection.timestamp_s > *before->timestamp_s) {
        duration = *detection.timestamp_s - *before->timestamp_s;
      }
      steps.push_back({before->frame, detection.frame, cv::norm(moved), duration});
    }
    before = &detection;
  }
  return steps;
}

/// Loops contradict odometry already in the detector, which has no use for places out of reach.
std::string out_of_reach(const std::vector<Detection>& detections) {
  const auto against = std::ranges::count(detections, Status::unreachable, &Detection::status);
  const auto in_favour = std::ranges::count(detections, Status::loop, &Detection::status);
  if (against < kLeast || against <= in_favour) return "";
  return fmt::format(
      "{} frames show a place that is out of reach by odometry, and only {} one in reach", against,
      in_favour);
}

/// A loop is reported if it is right with a probability of 0.98, so the graph should reject few.
std::string rejected(const std::optional<Correction>& correction) {
  constexpr int kExpectedShare = 10;
  if (!correction || correction->rejected() < kLeast) return "";
  const int loops = correction->rejected() + correction->kept();
  if (correction->rejected() * kExpectedShare <= loops) return "";
  return fmt::format("the pose graph rejects {} of {} loops", correction->rejected(), loops);
}

/// Right odometry after a jump would have loops to places before.
std::string jump(const std::vector<Detection>& detections, const std::vector<Step>& steps) {
  constexpr double kFaster = 10;
  if (steps.size() < kLeast) return "";
  std::vector<Step> sorted = steps;
  std::ranges::sort(sorted, {}, &Step::speed);
  const Step& fastest = sorted.back();
  const double usual = sorted[sorted.size() * 9 / 10].speed();
  if (usual == 0 || fastest.speed() <= kFaster * usual) return "";
  for (const ReportedMatch& match : with_changes(match_list(detections)).matches) {
    if (match.is_loop && match.query >= fastest.to && match.match <= fastest.from) return "";
  }
  return fmt::format("it jumps by {:.1f} m from frame {} to frame {}, and no loop joins both sides",
                     fastest.distance_m, fastest.from, fastest.to);
}

std::string stop(const std::vector<Step>& steps) {
  const auto last = std::ranges::find_if(steps.rbegin(), steps.rend(),
                                         [](const Step& step) { return step.distance_m > 0; });
  const auto still = last - steps.rbegin();
  if (last == steps.rend() || still < kLeast || still * 10 < std::ssize(steps)) return "";
  return fmt::format("it stands still from frame {} to the end", last->to);
}

}  // namespace

std::string odometry_doubt(const std::vector<Detection>& detections,
                           const std::optional<Correction>& correction) {
  const std::vector<Step> steps = steps_of(detections);
  std::vector<std::string> reasons{out_of_reach(detections), rejected(correction),
                                   jump(detections, steps), stop(steps)};
  std::erase(reasons, "");
  if (reasons.empty()) return "";
  return fmt::format(
      "Odometry may be wrong: {}. If places do not look alike here, check its scale, axes and "
      "times, and look for jumps; compare with a run without it.",
      fmt::join(reasons, "; "));
}

}  // namespace loopbit
