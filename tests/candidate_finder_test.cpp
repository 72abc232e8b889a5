// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "candidate_finder.hpp"

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "test_support.hpp"

namespace loopbit::test {
namespace {

constexpr int kStepsOfLap = 100;

/// Three laps that look the same, of which each step shows another view; in each, the robot may be
/// at step 50.
class CandidatesOfLaps : public ::testing::Test {
 protected:
  explicit CandidatesOfLaps(int frames_per_step = 1)
      : places_(options_, nullptr), odometry_(options_, places_) {
    Random random;
    for (int place = 0; place < 3 * kStepsOfLap; ++place) {
      const RecentView::Look step{.is_step = place % frames_per_step == 0,
                                  .far_step = static_cast<std::size_t>(place / frames_per_step)};
      places_.add(place < kStepsOfLap ? random_content(random, 0.3)
                                      : places_.contents().content(place - kStepsOfLap),
                  Features{}, step, Detection{.frame = place}, {});
    }
  }

  /// Tells that lap number `lap`, from 0, shows the places of the first one.
  void know_lap(int lap) {
    for (int step = 0; step < kStepsOfLap; ++step) {
      places_.known_loops().add(lap * kStepsOfLap + step, step);
    }
  }

  /// Of a frame that looks like step 7 of each lap, where the robot may be at an earlier place with
  /// this probability.
  [[nodiscard]] FrameCandidates candidates(double probability) {
    Belief prior;
    double part = 0.5;
    for (const std::ptrdiff_t step : {50, 150, 250}) {
      prior.places.push_back({step, {part * probability}});
      part = 0.25;
    }
    const std::optional<OdometryPose> unknown;
    ExclusionWindow::View view;
    view.begin = places_.size();
    const BinaryContent content = places_.contents().content(7);
    const CandidateFinder finder(options_, places_, odometry_);
    return finder.find({content, view, prior, unknown}, {});
  }

  LoopDetectorOptions options_;
  Places places_;
  SessionOdometry odometry_;
};

using Numbers = std::vector<PlaceId>;

/// Those that a frame is compared with because the robot may be there.
class ExpectedPlaces : public CandidatesOfLaps {
 protected:
  ExpectedPlaces() { options_.retrieval.max_candidates = 1; }

  [[nodiscard]] Numbers expected(double probability) {
    const FrameCandidates found = candidates(probability);
    EXPECT_EQ(found.num_similar, 1U);
    Numbers places;
    for (const Candidate& c : found.places) {
      if (c.place % kStepsOfLap != 7) places.push_back(c.place);
    }
    return places;
  }
};

const Numbers kAroundAll = {48, 49, 50, 51, 52, 148, 149, 150, 151, 152, 248, 249, 250, 251, 252};

TEST_F(ExpectedPlaces, AreThoseAroundEachPath) { EXPECT_EQ(expected(0.99), kAroundAll); }

TEST_F(ExpectedPlaces, OfManyLapsAreFewerWhereTheRobotIsSurelyBack) {
  know_lap(1);
  EXPECT_EQ(expected(0.99), kAroundAll) << "two laps, and another place";
  know_lap(2);
  EXPECT_EQ(expected(0.99), (Numbers{48, 49, 50, 51, 52, 150, 250}));
  EXPECT_EQ(expected(0.9), kAroundAll) << "not sure";
}

/// Those that look most alike and form the null of the votes.
class SimilarPlaces : public CandidatesOfLaps {
 protected:
  static Numbers similar(const FrameCandidates& found) {
    Numbers places;
    for (std::size_t i = 0; i < found.num_similar; ++i) places.push_back(found.places[i].place);
    return places;
  }

  [[nodiscard]] Numbers all_similar(int most, double probability = 0) {
    options_.retrieval.max_candidates = most;
    return similar(candidates(probability));
  }
};

TEST_F(SimilarPlaces, AreHalfWhereTheRobotIsSurelyBack) {
  EXPECT_EQ(all_similar(30, 0.9).size(), 30U);
  EXPECT_EQ(all_similar(30, 0.99).size(), 15U);
}

TEST_F(SimilarPlaces, AreDifferentOnesWhereTooManyAreLaps) {
  const Numbers similar_to_7 = all_similar(24);
  const Numbers six = all_similar(6);
  ASSERT_EQ(Numbers(six.begin(), six.begin() + 3), (Numbers{7, 107, 207}));
  EXPECT_EQ(six, Numbers(similar_to_7.begin(), similar_to_7.begin() + 6));
  know_lap(1);
  know_lap(2);
  // More than two thirds are different: one of three laps each, in the order of their similarity.
  Numbers expected;
  for (std::size_t i = 0; i < 5; ++i) expected.push_back(similar_to_7[3 * i]);
  EXPECT_EQ(all_similar(6), expected);
  const FrameCandidates found = candidates(0);
  ASSERT_EQ(found.places.size(), 6U);
  EXPECT_EQ(found.places.back().place, 107) << "the most similar lap remains a candidate";
}

TEST_F(SimilarPlaces, MayBeLapsIfTheyAreFew) {
  const Numbers alike = all_similar(12);
  places_.known_loops().add(107, 7);
  EXPECT_EQ(all_similar(12), alike);
}

/// Neighbouring places are only a few steps apart, although no loop connects them.
class SimilarPlacesOfASlowRobot : public CandidatesOfLaps {
 protected:
  SimilarPlacesOfASlowRobot() : CandidatesOfLaps(5) {}
};

TEST_F(SimilarPlacesOfASlowRobot, AreNoLaps) {
  for (const int most : {6, 9, 12, 15}) {
    options_.retrieval.max_candidates = most;
    EXPECT_EQ(candidates(0).num_similar, static_cast<std::size_t>(most));
  }
}

TEST_F(SimilarPlaces, OfASmallMapMayBeLaps) {
  const Numbers alike = all_similar(27);
  know_lap(1);
  know_lap(2);
  EXPECT_EQ(all_similar(27), alike) << "the map has fewer than 108 candidates";
}

}  // namespace
}  // namespace loopbit::test
