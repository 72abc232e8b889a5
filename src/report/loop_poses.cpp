// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loop_poses.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/evidence_file.hpp"

namespace loopbit::report {
namespace {

using Json = nlohmann::ordered_json;

/// Epipolar lines of a pair, and points of each.
constexpr std::size_t kLines = 8;
constexpr int kLinePoints = 33;

double rounded(double value) {
  constexpr double kDigits = 1e5;
  return std::round(value * kDigits) / kDigits;
}

cv::Vec3d translation_of(const RelativePose& pose) {
  const cv::Matx44d& t = pose.T_match_query;
  return {t(0, 3), t(1, 3), t(2, 3)};
}

cv::Matx33d rotation_of(const RelativePose& pose) {
  return pose.T_match_query.get_minor<3, 3>(0, 0);
}

/// The largest standard deviation in the part of a covariance that begins at `first`.
double largest_sigma(const cv::Matx66d& covariance, int first) {
  cv::Vec3d values;
  cv::eigen(covariance.get_minor<3, 3>(first, first), values);
  return std::sqrt(std::max(values[0], 0.0));
}

/// Where a camera sees a ray, from 0 to 1 of its image; none outside.
std::optional<cv::Point2d> seen_at(const CameraModel& camera, const cv::Vec3d& ray) {
  const auto pixel = project(camera, ray);
  if (!pixel) return std::nullopt;
  const cv::Point2d at(((*pixel)[0] + 0.5) / camera.size_px.width,
                       ((*pixel)[1] + 0.5) / camera.size_px.height);
  const bool is_within = at.x >= 0 && at.x <= 1 && at.y >= 0 && at.y <= 1;
  return is_within ? std::optional(at) : std::nullopt;
}

/// Where the match may see a point of the query: an arc from the point at infinity to the query's
/// camera, in the parts that lie within the image.
Json epipolar_line(const CameraModel& camera, const RelativePose& pose, const cv::Vec3d& ray) {
  const cv::Vec3d far = rotation_of(pose) * ray;
  const cv::Vec3d near = cv::normalize(translation_of(pose));
  const double angle = std::acos(std::clamp(far.dot(near), -1.0, 1.0));
  Json parts = Json::array();
  bool is_open = false;
  for (int i = 0; i < kLinePoints; ++i) {
    const double along = angle * i / (kLinePoints - 1);
    const cv::Vec3d across = cv::normalize(near - far * far.dot(near));
    const auto at = seen_at(camera, far * std::cos(along) + across * std::sin(along));
    if (at && !is_open) parts.push_back(Json::array());
    is_open = at.has_value();
    if (!at) continue;
    parts.back().push_back(rounded(at->x));
    parts.back().push_back(rounded(at->y));
  }
  return parts;
}

/// Of some inliers: the point in the query and its line in the match.
Json epipolar_lines(const CameraModel& camera, const RelativePose& pose,
                    const std::vector<PointPair>& inliers) {
  Json lines = Json::array();
  const std::size_t count = std::min(kLines, inliers.size());
  for (std::size_t i = 0; i < count; ++i) {
    const cv::Point2f& query = inliers[i * inliers.size() / count].query;
    const cv::Vec2d pixel(static_cast<double>(query.x) * camera.size_px.width - 0.5,
                          static_cast<double>(query.y) * camera.size_px.height - 0.5);
    const auto ray = unproject(camera, pixel);
    if (!ray) continue;
    lines.push_back({{"query", {rounded(query.x), rounded(query.y)}},
                     {"match", epipolar_line(camera, pose, *ray)}});
  }
  return lines;
}

/// The covariance of the position in the frame of the match, seen from above: xx, xz, zz.
Json position_from_above(const RelativePose& pose) {
  const cv::Matx33d turn = rotation_of(pose);
  const cv::Matx33d spread = turn * pose.covariance.get_minor<3, 3>(0, 0) * turn.t();
  return {spread(0, 0), spread(0, 2), spread(2, 2)};
}

Json pose_json(const LoopPose& loop) {
  const RelativePose& pose = loop.pose;
  Json json{{"match", loop.match ? Json(*loop.match) : Json()},
            {"status", to_string(pose.status)},
            {"known", to_string(pose.known)},
            {"scale", to_string(pose.scale)},
            {"inliers", loop.inliers},
            {"points", pose.points}};
  if (pose.known == PoseKnown::nothing) return json;
  const cv::Matx33d turn = rotation_of(pose);
  const cv::Vec3d ahead(turn(0, 2), turn(1, 2), turn(2, 2));
  json["rms_px"] = pose.rms_px;
  json["rotation_rad"] = std::acos(std::clamp((cv::trace(turn) - 1) / 2, -1.0, 1.0));
  json["rotation_sigma_rad"] = largest_sigma(pose.covariance, 3);
  json["heading"] = {ahead[0], ahead[1], ahead[2]};
  if (pose.known == PoseKnown::rotation) return json;
  const cv::Vec3d t = translation_of(pose);
  json["translation"] = {t[0], t[1], t[2]};
  json["translation_sigma"] = largest_sigma(pose.covariance, 0);
  json["position_from_above"] = position_from_above(pose);
  return json;
}

}  // namespace

Json loop_poses(const FinishedRun& run, const Json& pictures) {
  if (run.poses.empty()) return nullptr;
  std::optional<EvidenceReader> evidence;
  if (!run.evidence_path.empty()) evidence.emplace(run.evidence_path);
  Json poses = Json::object();
  for (const LoopPose& loop : run.poses) {
    const std::string query = std::to_string(loop.query);
    Json json = pose_json(loop);
    StoredEvidence stored;
    const bool has_lines = run.camera && !run.camera->size_px.empty() && loop.match &&
                           loop.pose.known >= PoseKnown::direction && pictures.contains(query);
    if (has_lines && evidence && evidence->read(loop.query, stored)) {
      json["epipolar"] = epipolar_lines(*run.camera, loop.pose, stored.inliers);
    }
    poses[query] = std::move(json);
  }
  return poses;
}

}  // namespace loopbit::report
