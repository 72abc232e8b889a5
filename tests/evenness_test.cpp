// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "evenness.hpp"

#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "test_support.hpp"

namespace loopbit::test {
namespace {

constexpr int kPerCell = 40;

/// An image of 640 x 480 px with 40 features in each of 4 x 3 cells, numbered from the upper left,
/// seen by a camera that has turned right by `dx_px`, or is nearer and sees them `scale` as large.
Features grid_image(float dx_px = 0, float scale = 1) {
  Features features;
  features.working_size_px = {640, 480};
  for (int cell = 0; cell < 12; ++cell) {
    for (int i = 0; i < kPerCell; ++i) {
      const auto x_px = static_cast<float>(160 * (cell % 4) + 4 * i + 2);
      const auto y_px = static_cast<float>(160 * (cell / 4) + 80);
      features.keypoints.push_back({.x_px = scale * (x_px - 320) + 320 - dx_px,
                                    .y_px = scale * (y_px - 240) + 240,
                                    .scale = 2 * scale,
                                    .angle_rad = 0});
    }
  }
  features.descriptors.resize(features.keypoints.size());
  return features;
}

class Frame {
 public:
  [[nodiscard]] const Features& features() const { return features_; }

  /// Inliers with so many of the features in each of `cells`.
  [[nodiscard]] static std::vector<Match> inliers(const std::vector<int>& cells, int in_each) {
    std::vector<Match> inliers;
    for (const int cell : cells) {
      for (int i = 0; i < in_each; ++i) {
        inliers.push_back({kPerCell * cell + i, kPerCell * cell + i});
      }
    }
    return inliers;
  }

  [[nodiscard]] SharedView view(const std::vector<int>& cells, int in_each) const {
    const std::vector<Match> shared = inliers(cells, in_each);
    return {static_cast<int>(shared.size()), count_inliers(features_, shared)};
  }

 private:
  Features features_ = grid_image();
};

std::vector<int> cells(int first, int last) {
  std::vector<int> all(static_cast<std::size_t>(last - first + 1));
  std::iota(all.begin(), all.end(), first);
  return all;
}

TEST(Evenness, CountsInliersByCell) {
  const Frame frame;
  const KeypointCounts counts = count_inliers(frame.features(), Frame::inliers({0, 3, 11}, 7));
  EXPECT_EQ(counts, (KeypointCounts{7, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 7}));
}

TEST(Evenness, OfInliersWhereverTheFrameCanBeRecognisedIsHigh) {
  const Frame frame;
  const Evenness evenness(frame.view(cells(0, 11), 20), frame.features());
  EXPECT_GE(evenness.of(Frame::inliers(cells(0, 11), 10), 120, grid_image()), 1);
}

TEST(Evenness, OfInliersInOnePartIsTheShareOfThatPart) {
  const Frame frame;
  const Evenness evenness(frame.view(cells(0, 11), 20), frame.features());
  const double left_half =
      evenness.of(Frame::inliers({0, 1, 4, 5, 8, 9}, 40), 100'000, grid_image());
  EXPECT_NEAR(left_half, 0.5, 0.01);
  EXPECT_NEAR(evenness.of(Frame::inliers({6}, 40), 100'000, grid_image()), 1.0 / 12, 0.01);
}

TEST(Evenness, WhereNothingCanBeRecognisedNoInliersAreExpected) {
  const Frame frame;
  // Only the lower row is recognised, such as a street below a grey sky.
  const Evenness evenness(frame.view(cells(8, 11), 40), frame.features());
  EXPECT_GT(evenness.of(Frame::inliers(cells(8, 11), 30), 120, grid_image()), 0.9);
  EXPECT_LT(evenness.of(Frame::inliers(cells(0, 3), 30), 120, grid_image()), 0.1);
}

TEST(Evenness, WhatThePlaceDoesNotShowIsNotExpected) {
  const Frame frame;
  const Evenness evenness(frame.view(cells(0, 11), 20), frame.features());
  // The right half of the frame is the left half of the place, so no more of it can be found.
  const std::vector<Match> right_half = Frame::inliers({2, 3, 6, 7, 10, 11}, 40);
  EXPECT_NEAR(evenness.of(right_half, 100'000, grid_image(320)), 1, 0.01);
  EXPECT_NEAR(evenness.of(right_half, 100'000, grid_image()), 0.5, 0.01);
  // Twice as near, the place shows the middle of the frame: half of it each way.
  std::vector<Match> middle;
  const Features nearer = grid_image(0, 2);
  for (int i = 0; i < 12 * kPerCell; ++i) {
    const Keypoint& keypoint = nearer.keypoint(i);
    if (keypoint.x_px >= 0 && keypoint.x_px < 640 && keypoint.y_px >= 0 && keypoint.y_px < 480) {
      middle.push_back({i, i});
    }
  }
  EXPECT_NEAR(evenness.of(middle, 100'000, nearer), 1, 0.01);
  EXPECT_LT(evenness.of(middle, 100'000, grid_image()), 0.4);
}

TEST(Evenness, WithoutAnEarlierViewIsMeasuredByAllFeatures) {
  const Frame frame;
  const Evenness evenness({}, frame.features());
  EXPECT_GE(evenness.of(Frame::inliers(cells(0, 11), 10), 120, grid_image()), 1);
  EXPECT_NEAR(evenness.of(Frame::inliers({0, 1, 4, 5, 8, 9}, 40), 100'000, grid_image()), 0.5,
              0.01);
}

TEST(Evenness, OfRandomInliersIsOneOnAverageHoweverFew) {
  const Frame frame;
  const Evenness evenness(frame.view(cells(0, 11), 20), frame.features());
  Random random;
  for (const int number : {12, 30, 100}) {
    double sum = 0;
    constexpr int kTrials = 2000;
    for (int trial = 0; trial < kTrials; ++trial) {
      std::vector<Match> inliers;
      for (int i = 0; i < number; ++i) {
        const int feature = random.between(0, 479);
        inliers.push_back({feature, feature});
      }
      sum += evenness.of(inliers, number, grid_image());
    }
    EXPECT_NEAR(sum / kTrials, 1, 0.06) << number;  // as shares of so few are not quite normal
  }
}

TEST(Evenness, IsOneWithoutInliersOrFeatures) {
  const Frame frame;
  EXPECT_DOUBLE_EQ(Evenness(frame.view({0}, 20), frame.features()).of({}, 0, grid_image()), 1);
  EXPECT_DOUBLE_EQ(Evenness({}, Features{}).of({}, 0, grid_image()), 1);
}

}  // namespace
}  // namespace loopbit::test
