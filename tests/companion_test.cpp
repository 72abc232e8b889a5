// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "companion.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "image_parts.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

/// Features all over the image, 20 px apart.
Features image() {
  Features features;
  features.working_size_px = {640, 480};
  for (int y_px = 10; y_px < 480; y_px += 20) {
    for (int x_px = 10; x_px < 640; x_px += 20) {
      features.keypoints.push_back(
          {static_cast<float>(x_px), static_cast<float>(y_px), 2.0F, 0.0F});
    }
  }
  features.descriptors.resize(features.keypoints.size());
  return features;
}

/// Every third of those within `part`.
std::vector<Keypoint> shared_within(const Features& features, const cv::Rect2f& part) {
  std::vector<Keypoint> shared;
  for (std::size_t i = 0; i < features.keypoints.size(); i += 3) {
    const Keypoint& keypoint = features.keypoints[i];
    if (part.contains({keypoint.x_px, keypoint.y_px})) shared.push_back(keypoint);
  }
  return shared;
}

TEST(Companion, CoversAllOfTheThing) {
  const Features features = image();
  const cv::Rect2f thing(200, 240, 160, 120);
  const BinaryContent pixels = companion_pixels(features, shared_within(features, thing));
  const auto shows_thing = [&](const Keypoint& keypoint) {
    return is_set(pixels, content_pixel(keypoint, features.working_size_px));
  };
  int covered = 0;
  int others = 0;
  for (const Keypoint& keypoint : features.keypoints) {
    const bool is_thing = thing.contains({keypoint.x_px, keypoint.y_px});
    if (shows_thing(keypoint)) ++(is_thing ? covered : others);
  }
  EXPECT_GE(covered, 44) << "of 48";
  EXPECT_LE(others, 28) << "those right beside it";
}

TEST(Companion, IsLessThanHalfOfTheImage) {
  const Features features = image();
  EXPECT_GT(count(companion_pixels(features, shared_within(features, {0, 0, 460, 230}))), 0);
  EXPECT_EQ(count(companion_pixels(features, shared_within(features, {0, 0, 640, 230}))), 0);
}

}  // namespace
}  // namespace loopbit::test
