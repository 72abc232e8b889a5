// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "attached_parts.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "test_support.hpp"

namespace loopbit::test {
namespace {

constexpr int kViewWidth_px = 640;
constexpr int kViewHeight_px = 480;
constexpr int kBonnetTop_px = 400;

void add_feature(Features& features, int x_px, int y_px) {
  features.keypoints.push_back({static_cast<float>(x_px), static_cast<float>(y_px), 2.0F, 0.0F});
  features.descriptors.emplace_back();
}

/// Features at random above the bonnet.
Features bare_view(Random& random) {
  Features features;
  features.working_size_px = {kViewWidth_px, kViewHeight_px};
  for (int i = 0; i < 200; ++i) {
    add_feature(features, random.between(0, kViewWidth_px - 1),
                random.between(0, kBonnetTop_px - 1));
  }
  features.num_dark = features.keypoints.size() / 2;
  return features;
}

/// With a bonnet, whose features stand 20 px apart.
Features view_with_bonnet(Random& random) {
  Features features = bare_view(random);
  for (int y = kBonnetTop_px + 10; y < kViewHeight_px; y += 20) {
    for (int x = 10; x < kViewWidth_px; x += 20) add_feature(features, x, y);
  }
  return features;
}

void note_view(AttachedParts& parts, const Features& features) {
  parts.reserve_next(features.working_size_px);
  parts.remember(features.working_size_px, features.keypoints);
}

std::size_t num_kept(const AttachedParts& parts, Features features) {
  parts.remove_from(features);
  EXPECT_EQ(features.keypoints.size(), features.descriptors.size());
  return features.keypoints.size();
}

TEST(AttachedParts, ABonnetIsRemovedAfterFourViews) {
  Random random;
  AttachedParts parts;
  for (int i = 0; i < 4; ++i) {
    const Features features = view_with_bonnet(random);
    EXPECT_EQ(num_kept(parts, features), features.keypoints.size());
    note_view(parts, features);
  }
  Features features = view_with_bonnet(random);
  parts.remove_from(features);
  EXPECT_GE(features.keypoints.size(), 190U);
  for (const Keypoint& keypoint : features.keypoints) EXPECT_LT(keypoint.y_px, kBonnetTop_px);
  EXPECT_LE(features.num_dark, 100U);
  EXPECT_GE(features.num_dark, 90U);

  BinaryContent content;
  content.rows.fill(~std::uint64_t{0});
  parts.remove_from(content);
  EXPECT_EQ(content.rows[60], 0U) << "the bonnet";
  EXPECT_EQ(content.rows[20], ~std::uint64_t{0});
}

TEST(AttachedParts, AViewWithoutThemKeepsAll) {
  Random random;
  AttachedParts parts;
  for (int i = 0; i < 40; ++i) {
    const Features features = bare_view(random);
    EXPECT_EQ(num_kept(parts, features), features.keypoints.size()) << i;
    note_view(parts, features);
  }
}

TEST(AttachedParts, WhatHalfOfTheFirstEightViewsShowIsNone) {
  Random random;
  AttachedParts parts;
  for (int i = 0; i < 4; ++i) {
    note_view(parts, bare_view(random));
    const Features features = view_with_bonnet(random);
    EXPECT_EQ(num_kept(parts, features), features.keypoints.size()) << i;
    note_view(parts, features);
  }
  const Features features = view_with_bonnet(random);
  EXPECT_EQ(num_kept(parts, features), features.keypoints.size());
}

TEST(AttachedParts, ACameraThatStandsStillHasNone) {
  Random random;
  AttachedParts parts;
  const Features features = bare_view(random);
  for (int i = 0; i < 40; ++i) note_view(parts, features);
  EXPECT_EQ(num_kept(parts, features), features.keypoints.size());
}

TEST(AttachedParts, ANoisyCameraThatStandsStillHasNone) {
  Random random;
  AttachedParts parts;
  const Features scene = view_with_bonnet(random);
  for (int i = 0; i < 40; ++i) {
    Features features = scene;
    // Every other feature is another one.
    for (std::size_t k = 0; k < features.keypoints.size(); k += 2) {
      features.keypoints[k].x_px = static_cast<float>(random.between(0, kViewWidth_px - 1));
      features.keypoints[k].y_px = static_cast<float>(random.between(0, kViewHeight_px - 1));
    }
    EXPECT_EQ(num_kept(parts, features), features.keypoints.size()) << i;
    note_view(parts, features);
  }
}

TEST(AttachedParts, AreForgottenWhereTheyAreNoLongerSeen) {
  Random random;
  AttachedParts parts;
  for (int i = 0; i < 16; ++i) note_view(parts, view_with_bonnet(random));
  for (int i = 0; i < 9; ++i) note_view(parts, bare_view(random));
  note_view(parts, view_with_bonnet(random));
  const Features features = view_with_bonnet(random);
  EXPECT_EQ(num_kept(parts, features), features.keypoints.size());
}

/// Keypoint k of one is keypoint k of the other, as far as both are alike.
std::vector<Match> matches(std::size_t first, std::size_t last) {
  std::vector<Match> matches;
  for (std::size_t k = first; k < last; ++k) {
    matches.push_back({static_cast<int>(k), static_cast<int>(k)});
  }
  return matches;
}

TEST(AttachedParts, MayBeAllThatTwoImagesShare) {
  Random random;
  const Features place = view_with_bonnet(random);
  const Features query = view_with_bonnet(random);
  const std::size_t end = place.keypoints.size();
  EXPECT_TRUE(AttachedParts::may_be_all(query, place, matches(200, end))) << "the bonnet";
  EXPECT_FALSE(AttachedParts::may_be_all(query, place, matches(0, 200))) << "what moves";
  EXPECT_FALSE(AttachedParts::may_be_all(place, place, matches(0, end))) << "from the same place";
}

TEST(AttachedParts, OfAnotherCameraAreNotTheSame) {
  Random random;
  Features place = view_with_bonnet(random);
  place.working_size_px.width += 1;
  EXPECT_FALSE(AttachedParts::may_be_all(view_with_bonnet(random), place,
                                         matches(200, place.keypoints.size())));
}

TEST(AttachedParts, AreKnownAfterFourViews) {
  Random random;
  AttachedParts parts;
  const Features view = view_with_bonnet(random);
  for (int i = 0; i < AttachedParts::kFirstViews; ++i) {
    EXPECT_FALSE(parts.are_known(view.working_size_px)) << i;
    note_view(parts, view_with_bonnet(random));
  }
  EXPECT_TRUE(parts.are_known(view.working_size_px));
  EXPECT_FALSE(parts.are_known(view.working_size_px + cv::Size(1, 0)));
}

TEST(AttachedParts, AnotherWorkingSizeBeginsAnew) {
  Random random;
  AttachedParts parts;
  for (int i = 0; i < 16; ++i) note_view(parts, view_with_bonnet(random));
  Features features = view_with_bonnet(random);
  features.working_size_px = {kViewWidth_px + 1, kViewHeight_px};
  EXPECT_EQ(num_kept(parts, features), features.keypoints.size());
  note_view(parts, features);
  EXPECT_EQ(num_kept(parts, features), features.keypoints.size());
}

}  // namespace
}  // namespace loopbit::test
