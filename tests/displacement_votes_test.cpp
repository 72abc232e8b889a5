// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "displacement_votes.hpp"

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "candidate_verifier.hpp"

namespace loopbit {
namespace {

/// Features far apart, with descriptors that resemble no other.
Features scattered(int count, std::uint32_t seed) {
  std::mt19937 random(seed);
  Features features;
  features.working_size_px = {640, 480};
  features.num_dark = static_cast<std::size_t>(count) / 2;
  for (int i = 0; i < count; ++i) {
    features.keypoints.push_back(
        {static_cast<float>(40 + i % 10 * 60), static_cast<float>(40 + i / 10 * 60), 2.0F, 0.0F});
    Descriptor descriptor{};
    for (auto& element : descriptor) {
      element = static_cast<Descriptor::value_type>(static_cast<int>(random() % 101) - 50);
    }
    features.descriptors.push_back(descriptor);
  }
  return features;
}

std::vector<Match> nearest(const Features& query, const Features& place) {
  FirstLook look;
  Verifier().match_strongest(query, place, look);
  return DisplacementVotes(10.0).nearest_matches(query, place, look);
}

int votes(const Features& query, const Features& place) {
  FirstLook look;
  Verifier().match_strongest(query, place, look);
  return DisplacementVotes(10.0).count(query, place, look);
}

TEST(NearestMatches, NeedNoRatioButAreOneToOne) {
  const Features place = scattered(40, 4);
  Features query = place;
  EXPECT_EQ(nearest(query, place).size(), 40U);
  // Two features alike would fail a ratio test. One of them still matches.
  query.descriptors[3] = query.descriptors[2];
  const std::vector<Match> matches = nearest(query, place);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE(matches[i].place, matches[j].place);
  }
  EXPECT_TRUE(std::ranges::is_sorted(matches, {}, &Match::query));
  const auto of_second = std::count_if(matches.begin(), matches.end(),
                                       [](const Match& match) { return match.place == 2; });
  EXPECT_EQ(of_second, 1);
}

TEST(DisplacementVotes, CountsWhatMovedAlike) {
  const Features place = scattered(60, 1);
  Features query = place;
  for (std::size_t i = 0; i < query.keypoints.size(); ++i) {
    query.keypoints[i].x_px += 25;
    query.keypoints[i].y_px -= i % 2 == 0 ? 0.0F : 100.0F;  // every other one moves elsewhere
  }
  EXPECT_EQ(votes(query, place), 30);
  EXPECT_LT(votes(scattered(60, 2), place), 10);
}

TEST(DisplacementVotes, ANeighbourhoodVotesOnceAndScalesMustAgree) {
  Features place = scattered(40, 3);
  for (std::size_t i = 0; i < 10; ++i) {
    place.keypoints[i].x_px = 300 + static_cast<float>(i);
    place.keypoints[i].y_px = 400;
  }
  EXPECT_EQ(votes(place, place), 31);
  Features nearer = place;
  for (Keypoint& keypoint : nearer.keypoints) keypoint.scale *= 3;
  EXPECT_EQ(votes(nearer, place), 0);
}

TEST(InlierWorth, GrowsWithTheShareUpToTheFullOne) {
  EXPECT_DOUBLE_EQ(inlier_worth(0.0, 0), 0);
  EXPECT_DOUBLE_EQ(inlier_worth(0.025, 0), 0.5);
  EXPECT_DOUBLE_EQ(inlier_worth(0.1, 0), 1);
  EXPECT_DOUBLE_EQ(inlier_worth(0.9, 0), 1);
}

TEST(InlierWorth, FallsWithWhatTheViewSharesWithTheStepBefore) {
  EXPECT_DOUBLE_EQ(inlier_worth(1, 40), 1);
  EXPECT_DOUBLE_EQ(inlier_worth(1, 50), 0.8);
  EXPECT_DOUBLE_EQ(inlier_worth(1, 80), 0.5);
  EXPECT_DOUBLE_EQ(inlier_worth(1, 600), 0.5) << "but never less than half";
}

TEST(CandidateGeometry, EvidenceIsDistinctInliersThatCountInFull) {
  const CandidateGeometry geometry{.matches = 99,
                                   .inliers = 60,
                                   .distinct_inliers = 40,
                                   .inlier_worth = 0.5,
                                   .distinctness = 0.25};
  EXPECT_DOUBLE_EQ(geometry.evidence(), 5);
}

}  // namespace
}  // namespace loopbit
