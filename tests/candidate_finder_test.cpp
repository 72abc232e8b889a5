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

/// Three laps, of which each step shows another view; in each, the robot may be at step 50.
class ExpectedPlaces : public ::testing::Test {
 protected:
  ExpectedPlaces() : places_(options_, nullptr), odometry_(options_, places_) {
    options_.retrieval.max_candidates = 1;
    Random random;
    for (int place = 0; place < 3 * kStepsOfLap; ++place) {
      const RecentView::Look step{.is_step = true, .far_step = static_cast<std::size_t>(place)};
      places_.add(random_content(random, 0.3), Features{}, step, Detection{.frame = place}, {});
    }
  }

  /// Tells that lap number `lap`, from 0, shows the places of the first one.
  void know_lap(int lap) {
    for (int step = 0; step < kStepsOfLap; ++step) {
      places_.known_loops().add(lap * kStepsOfLap + step, step);
    }
  }

  /// Those that a frame is compared with because the robot may be there with this probability.
  [[nodiscard]] std::vector<PlaceId> expected(double probability) {
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
    const FrameCandidates found = finder.find({content, view, prior, unknown}, {});
    EXPECT_EQ(found.num_similar, 1U);
    std::vector<PlaceId> places;
    for (const Candidate& c : found.places) {
      if (c.place != 7) places.push_back(c.place);
    }
    return places;
  }

  LoopDetectorOptions options_;
  Places places_;
  SessionOdometry odometry_;
};

using Numbers = std::vector<PlaceId>;

const Numbers kAroundAll = {48, 49, 50, 51, 52, 148, 149, 150, 151, 152, 248, 249, 250, 251, 252};

TEST_F(ExpectedPlaces, AreThoseAroundEachPath) { EXPECT_EQ(expected(0.99), kAroundAll); }

TEST_F(ExpectedPlaces, OfManyLapsAreFewerWhereTheRobotIsSurelyBack) {
  know_lap(1);
  EXPECT_EQ(expected(0.99), kAroundAll) << "two laps, and another place";
  know_lap(2);
  EXPECT_EQ(expected(0.99), (Numbers{48, 49, 50, 51, 52, 150, 250}));
  EXPECT_EQ(expected(0.9), kAroundAll) << "not sure";
}

}  // namespace
}  // namespace loopbit::test
