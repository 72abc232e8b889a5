// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "map_support.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

#include "loopbit/database.hpp"

#include "test_support.hpp"

namespace loopbit::test {

LoopDetectorOptions fast_options() {
  LoopDetectorOptions options;
  options.surf = {.working_area_px = 320 * 240, .max_keypoints = 300};
  options.decision.min_score = 0.5;  // the maps are small
  return options;
}

/// Features of the frame `number`: a few, whose values follow from it.
Features few_features(int number) {
  Features features;
  features.working_size_px = {640, 480};
  features.num_dark = 1;
  for (int i = 0; i < 3; ++i) {
    features.keypoints.push_back({static_cast<float>(number), static_cast<float>(i), 1.2F, 0.0F});
    features.descriptors.emplace_back();
    features.descriptors.back().fill(static_cast<std::int8_t>((number + i) % 255 - 127));
  }
  return features;
}

BinaryContent content_of(int number) {
  Random random(number);
  return random_content(random, 0.3);
}

OdometryPose odometry_of(int number) {
  OdometryPose odometry;
  odometry.T_odometry_camera = {0,  0, 1, 0.1 * number,       0, 1, 0, 0.3,
                                -1, 0, 0, 1.0 / (number + 3), 0, 0, 0, 1};
  if (number % 2 == 0) odometry.covariance = 1e-6 * (number + 1) * cv::Matx66d::eye();
  return odometry;
}

KnownMotion motion_of(int number) {
  return {PoseKnown::metric,
          {odometry_of(number + 1).T_odometry_camera,
           0.001 * number * cv::Matx66d::eye() + 0.0001 * cv::Matx66d::ones()}};
}

bool same_features(const Features& a, const Features& b) {
  const auto values = [](const Keypoint& k) {
    return std::tuple(k.x_px, k.y_px, k.scale, k.angle_rad);
  };
  return a.working_size_px == b.working_size_px && a.num_dark == b.num_dark &&
         a.descriptors == b.descriptors &&
         std::equal(a.keypoints.begin(), a.keypoints.end(), b.keypoints.begin(), b.keypoints.end(),
                    [&](const Keypoint& p, const Keypoint& q) { return values(p) == values(q); });
}

std::vector<unsigned char> image_bytes(int number) {
  std::vector<unsigned char> bytes(static_cast<std::size_t>(1000 + number % 7));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<unsigned char>(7 * i + static_cast<std::size_t>(number));
  }
  return bytes;
}

std::vector<unsigned char> encode_image(const cv::Mat& image) {
  return image_bytes(image.at<int>(0, 0));
}

void add_frame(MapWriter& map, int frame, std::optional<SessionFrame> loop) {
  Detection detection{.frame = frame, .timestamp_s = 0.5 * frame, .odometry = odometry_of(frame)};
  if (loop) {
    detection.status = Status::loop;
    detection.earlier_match = loop;
    detection.score = 0.995;
    detection.similarity = 0.25;
    detection.matches = 40;
    detection.inliers = 31;
  }
  map.add(detection, content_of(frame), std::make_shared<const Features>(few_features(frame)),
          cv::Mat(1, 1, CV_32S, cv::Scalar(frame)));
}

/// A map of one more session of `frames` frames.
void add_session(const std::string& path, int frames, const std::string& name,
                 std::optional<SessionFrame> loop_of_last, const EncodeImage& encode) {
  MapWriter map(path, fast_options(), name, encode);
  for (int frame = 0; frame < frames; ++frame) {
    add_frame(map, frame, frame + 1 == frames ? loop_of_last : std::nullopt);
  }
  map.finish();
}

std::vector<MapPlace> places_of(MapReader& map) {
  std::vector<MapPlace> places;
  map.for_each_place([&](const MapPlace& place) { places.push_back(place); });
  return places;
}

std::vector<MapPlace> places_of(const std::string& path) {
  MapReader map(path);
  return places_of(map);
}

/// That of frames without a covariance is tested elsewhere.
void expect_only_true_odometry(MapReader& map) {
  for (const MapOdometry& odometry : map.odometry()) {
    const OdometryPose expected = odometry_of(odometry.at.frame);
    EXPECT_EQ(odometry.timestamp_s, 0.5 * odometry.at.frame);
    EXPECT_EQ(odometry.pose.T_odometry_camera, expected.T_odometry_camera) << odometry.at.frame;
    EXPECT_EQ(odometry.pose.covariance, expected.covariance.value_or(*odometry.pose.covariance));
  }
}

/// Every place is what add_session() wrote for its frame, or it is not there.
void expect_only_true_places(MapReader& map) {
  expect_only_true_odometry(map);
  for (const MapPlace& place : places_of(map)) {
    EXPECT_EQ(place.content, content_of(place.at.frame)) << place.id;
    EXPECT_EQ(place.timestamp_s, 0.5 * place.at.frame);
    const auto image = map.image_of(place);
    EXPECT_EQ(image.value_or(image_bytes(place.at.frame)), image_bytes(place.at.frame)) << place.id;
    const auto features = map.features_of(place);
    if (!features) continue;
    EXPECT_TRUE(same_features(*features, few_features(place.at.frame))) << place.id;
  }
}

std::string read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

bool is_one_file(const std::string& path) {
  // sqlite.org/fileformat2.html, 1.3.3: bytes 18 and 19 are 2 where there is a log.
  return read_bytes(path).substr(18, 2) == "\1\1" && !std::filesystem::exists(path + "-wal") &&
         !std::filesystem::exists(path + "-shm");
}

void make_older(const std::string& path, int version) {
  constexpr std::pair<int, const char*> kTables[] = {
      {4, "odometry"}, {4, "relative_pose"}, {3, "linked"}, {3, "rejected"}, {2, "image"}};
  std::string sql = "PRAGMA user_version = " + std::to_string(version);
  for (const auto& [since, table] : kTables) {
    if (since > version) sql += std::string("; DROP TABLE ") + table;
  }
  change(path, sql + "; VACUUM");
}

void change(const std::string& path, const std::string& sql) {
  const Database database(path, Database::Access::create, {});
  database.execute(sql);
}

}  // namespace loopbit::test
