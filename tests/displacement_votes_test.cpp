// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "displacement_votes.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
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

Votes counted(const Features& query, const Features& place) {
  FirstLook look;
  Verifier().match_strongest(query, place, 300, look);
  DisplacementVotes votes(10.0);
  votes.begin(query, std::span(&look, 1));
  return votes.count(query, place, look);
}

int votes(const Features& query, const Features& place) { return counted(query, place).count; }

TEST(DisplacementVotes, NeedNoRatioButAreOneToOne) {
  const Features place = scattered(40, 4);
  Features query = place;
  EXPECT_EQ(votes(query, place), 40);
  // Two features alike would fail a ratio test. One of them still counts, not both.
  query.descriptors[3] = query.descriptors[2];
  query.keypoints[3].x_px = query.keypoints[2].x_px + 25;
  EXPECT_EQ(votes(query, place), 39);
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

TEST(DisplacementVotes, TellWhereAndHowManyElsewhere) {
  const Features place = scattered(60, 5);
  Features query = place;
  for (std::size_t i = 0; i < query.keypoints.size(); ++i) {
    query.keypoints[i].x_px += i % 3 == 0 ? -100.0F : 35.0F;
  }
  const Votes found = counted(query, place);
  EXPECT_EQ(found.apart.in_square(found.square), 40);
  EXPECT_EQ(found.square, found.apart.fullest());
  const auto others = Displacements::moved(found.square, -4, 0);
  EXPECT_EQ(found.apart.in_square(others), 20) << "135 px are a little more than four bins";
  EXPECT_EQ(found.apart.in_square(Displacements::moved(found.square, 0, 60)), 0);
  EXPECT_EQ(found.apart.in_square(Displacements::moved(found.square, 0, -60)), 0);
}

TEST(DisplacementVotes, ANeighbourhoodCountsOnceForEachDisplacement) {
  Features place = scattered(40, 6);
  Features query = place;
  for (std::size_t i = 0; i < 4; ++i) {
    query.keypoints[i].x_px = 300 + 2 * static_cast<float>(i);
    query.keypoints[i].y_px = 300;
    place.keypoints[i] = query.keypoints[i];
    if (i >= 2) place.keypoints[i].x_px -= 200;  // two of them moved
  }
  const Votes found = counted(query, place);
  EXPECT_EQ(found.count, 37);
  int all = 0;
  for (int y = 0; y < Displacements::kRows; y += 2) {
    for (int x = 0; x < Displacements::kRows; x += 2) {
      all += found.apart.in_square(Displacements::moved(0, x, y));
    }
  }
  EXPECT_EQ(all, 38);
}

TEST(Neighbourhoods, AreThoseOfEachPair) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place_px(0, 300);
  std::uniform_real_distribution<float> scale(1, 12);
  std::vector<Keypoint> keypoints;
  std::vector<std::int16_t> asked;
  for (std::int16_t i = 0; i < 200; ++i) {
    keypoints.push_back({place_px(random), place_px(random), scale(random), 0});
    if (i % 5 != 0) asked.push_back(i);
  }
  Neighbourhoods neighbourhoods;
  for (int again = 0; again < 2; ++again) neighbourhoods.find(keypoints, asked, 5);
  for (const std::int16_t i : asked) {
    std::vector<std::int16_t> expected;
    for (const std::int16_t j : asked) {
      const Keypoint& a = keypoints[static_cast<std::size_t>(i)];
      const Keypoint& b = keypoints[static_cast<std::size_t>(j)];
      const float distance = std::hypot(a.x_px - b.x_px, a.y_px - b.y_px);
      if (j < i && distance < 5 * std::min(a.scale, b.scale)) expected.push_back(j);
    }
    const auto found = neighbourhoods.before(i);
    EXPECT_TRUE(std::ranges::is_permutation(found, expected)) << i;
  }
}

TEST(InlierWorth, GrowsWithTheShareUpToTheFullOne) {
  EXPECT_DOUBLE_EQ(inlier_worth(0.0, 1), 0);
  EXPECT_DOUBLE_EQ(inlier_worth(0.025, 1), 0.5);
  EXPECT_DOUBLE_EQ(inlier_worth(0.1, 1), 1);
  EXPECT_DOUBLE_EQ(inlier_worth(0.9, 1.2), 1);
}

TEST(InlierWorth, IsThatOfEvennessWhereThatIsLess) {
  EXPECT_DOUBLE_EQ(inlier_worth(0.9, 0.85), 1);
  EXPECT_DOUBLE_EQ(inlier_worth(0.9, 0.34), 0.4);
  EXPECT_DOUBLE_EQ(inlier_worth(0.025, 0.34), 0.4);
}

TEST(ViewWorth, FallsWithWhatTheViewSharesWithTheStepBefore) {
  EXPECT_DOUBLE_EQ(view_worth(0), 1);
  EXPECT_DOUBLE_EQ(view_worth(40), 1);
  EXPECT_DOUBLE_EQ(view_worth(50), 0.8);
  EXPECT_DOUBLE_EQ(view_worth(80), 0.5);
  EXPECT_DOUBLE_EQ(view_worth(600), 0.5) << "but never less than half";
}

TEST(CandidateGeometry, EvidenceIsDistinctInliersThatCountInFull) {
  const CandidateGeometry geometry{.matches = 99,
                                   .inliers = std::vector<Match>(60),
                                   .distinct_inliers = 40,
                                   .inlier_worth = 0.5,
                                   .view_worth = 0.8,
                                   .distinctness = 0.25};
  EXPECT_DOUBLE_EQ(geometry.evidence(), 4);
  EXPECT_DOUBLE_EQ(geometry.evidence(0.5), 4) << "a small map is no second reason to doubt them";
  EXPECT_DOUBLE_EQ(geometry.evidence(0.25), 2);
  EXPECT_DOUBLE_EQ(geometry.excess(0.25), -6);
}

}  // namespace
}  // namespace loopbit
