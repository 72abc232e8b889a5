// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "voted_paths.hpp"

#include <random>

#include <gtest/gtest.h>

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

int votes(const Features& query, const Features& place) {
  FirstLook look;
  Verifier().match_strongest(query, place, look);
  return displacement_votes(query, place, look, 10.0);
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

TEST(VotedPaths, ScoresAreDeviationsFromWhatSimilarPlacesHave) {
  std::vector<VotedPaths::Votes> votes;
  for (int i = 0; i < 9; ++i) votes.push_back({i * 3, i * 3, 4 + i % 3});
  votes.push_back({50, 50, 60});  // where a path leads
  const auto scores = VotedPaths::scores(votes, 9);
  ASSERT_EQ(scores.size(), 10U);
  EXPECT_EQ(scores.back().place, 50);
  EXPECT_DOUBLE_EQ(scores.back().sigmas, 3.0);
  for (const auto& score : scores) EXPECT_LE(std::abs(score.sigmas), 3.0);
  EXPECT_LT(std::abs(scores.front().sigmas), 1.0);
  EXPECT_TRUE(VotedPaths::scores(votes, 7).empty()) << "too few to be a null";
}

/// Ten steps along the past up to step 110 at `speed`, while other places have nothing, but for
/// those `apart` from them, if that is not 0.
std::optional<VotedPaths::Best> after_ten_steps(double speed, std::ptrdiff_t apart,
                                                double last_sigmas = 2,
                                                std::ptrdiff_t one_place_apart = 0) {
  VotedPaths paths;
  for (int t = 0; t < 10; ++t) {
    const std::ptrdiff_t step = 110 - std::lround(speed * (9 - t));
    const double sigmas = t == 9 ? last_sigmas : 2;
    VotedPaths::Scores scores{{static_cast<PlaceId>(step), step, sigmas}};
    if (apart != 0) scores.push_back({static_cast<PlaceId>(step + apart), step + apart, 1.5});
    const auto sorted = paths.paths(scores, true);
    if (t == 9) {
      return VotedPaths::best(sorted, [&](std::ptrdiff_t at) {
        return Spot{at, one_place_apart != 0 && at > 150 ? at - one_place_apart : at};
      });
    }
    paths.remember(scores, sorted, true);
  }
  return std::nullopt;
}

TEST(VotedPaths, FindsAPathAtAnySpeedAndDirection) {
  for (const double speed : {0.6, 1.0, 1.4, -0.6, -1.0}) {
    const auto best = after_ten_steps(speed, 0);
    ASSERT_TRUE(best) << speed;
    EXPECT_EQ(best->path.end.step, 110);
    EXPECT_GE(best->margin_sigmas, 17 / std::sqrt(20.0)) << speed;  // places are whole
  }
}

TEST(VotedPaths, ARivalElsewhereTakesTheMargin) {
  EXPECT_NEAR(after_ten_steps(1.0, 100)->margin_sigmas, 5 / std::sqrt(20.0), 1e-9);
  // Another lap through the same place is no rival, and nor is the place beside.
  EXPECT_NEAR(after_ten_steps(1.0, 100, 2, 100)->margin_sigmas, 20 / std::sqrt(20.0), 1e-9);
  EXPECT_NEAR(after_ten_steps(1.0, 12)->margin_sigmas, 20 / std::sqrt(20.0), 1e-9);
}

TEST(VotedPaths, ThePlaceBesideIsNoRivalWhateverIsKnownOfIt) {
  const VotedPaths paths;
  const VotedPaths::Scores scores{{100, 100, 2}, {105, 105, 2}};
  const auto best = VotedPaths::best(paths.paths(scores, true), [](std::ptrdiff_t step) {
    return Spot{step, step == 105 ? 5 : step};
  });
  EXPECT_NEAR(best->margin_sigmas, 2 / std::sqrt(20.0), 1e-9);
}

TEST(VotedPaths, TheFrameItselfMustSpeakForItsPlace) {
  EXPECT_TRUE(after_ten_steps(1.0, 0, 1.0));
  EXPECT_FALSE(after_ten_steps(1.0, 0, 0.9));
}

TEST(VotedPaths, APathThatIsNotSeenForOnceIsStillARival) {
  VotedPaths paths;
  for (int t = 0; t < 8; ++t) {
    const VotedPaths::Scores scores{{100 + t, 100 + t, 2}, {200 + t, 200 + t, 2}};
    paths.remember(scores, paths.paths(scores, true), true);
  }
  const auto best = VotedPaths::best(paths.paths({{108, 108, 2}}, true), [](std::ptrdiff_t step) {
    return Spot{step, step};
  });
  ASSERT_TRUE(best);
  EXPECT_NEAR(best->margin_sigmas, 2 / std::sqrt(20.0), 1e-9);
  // Both are looked at next.
  EXPECT_EQ(paths.expected_places(), (std::vector<PlaceId>{107, 108, 109, 207, 208, 209}));
}

TEST(VotedPaths, StandingStillAddsNothing) {
  VotedPaths paths;
  // Wherever an earlier frame would count, it has a score.
  VotedPaths::Scores scores;
  for (int step = 80; step <= 120; ++step) scores.push_back({step, step, 3});
  for (int t = 0; t < 20; ++t) paths.remember(scores, paths.paths(scores, t == 0), t == 0);
  EXPECT_DOUBLE_EQ(paths.paths(scores, false).front().sum, 3.0);
}

}  // namespace
}  // namespace loopbit
