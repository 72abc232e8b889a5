// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "distinctness.hpp"

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "known_loops.hpp"

namespace loopbit::test {
namespace {

/// Sightings of made-up places by features of one query.
class Sightings {
 public:
  /// `features`: which of the query's are inliers at the place of `step`.
  void add(std::ptrdiff_t step, const std::vector<int>& features) {
    std::vector<Match> inliers;
    inliers.reserve(features.size());
    for (const int feature : features)
      inliers.push_back({.query = feature, .place = 500 - feature});
    places_.emplace_back(step, std::move(inliers));
  }

  [[nodiscard]] double distinctness_of(std::size_t place, const KnownLoops& loops = {}) const {
    std::vector<Sighting> all;
    all.reserve(places_.size());
    for (const auto& [step, inliers] : places_) {
      all.push_back({{step, loops.first_visit(step)}, inliers});
    }
    const Sighting asked = all[place];
    std::sort(all.begin(), all.end(),
              [](const auto& a, const auto& b) { return a.spot.first_visit < b.spot.first_visit; });
    return distinctness(asked, all);
  }

 private:
  std::vector<std::pair<std::ptrdiff_t, std::vector<Match>>> places_;
};

TEST(Distinctness, IsOneWhereNoOtherPlaceSharesInliers) {
  Sightings sightings;
  sightings.add(10, {1, 2, 3, 4});
  sightings.add(50, {5, 6, 7});
  sightings.add(90, {});
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(0), 1);
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(1), 1);
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(2), 1);
}

TEST(Distinctness, EachOtherPlaceMakesASharedInlierCountLess) {
  Sightings sightings;
  sightings.add(10, {1, 2, 3, 4});
  sightings.add(50, {3, 4, 900});
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(0), (1 + 1 + 0.5 + 0.5) / 4);
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(1), (0.5 + 0.5 + 1) / 3);
  sightings.add(90, {4});
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(0), (1 + 1 + 0.5 + 1.0 / 3) / 4);
}

TEST(Distinctness, NeighboursAreOnePlace) {
  Sightings sightings;
  sightings.add(10, {1, 2});
  sightings.add(13, {1, 2});
  sightings.add(50, {2});
  sightings.add(53, {2});
  sightings.add(55, {2});
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(0), 0.75);
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(2), 0.5);
}

TEST(Distinctness, LapsWhoseLoopsAreKnownAreOnePlace) {
  Sightings sightings;
  sightings.add(10, {1, 2});
  sightings.add(110, {1, 2});
  sightings.add(210, {1, 2});
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(0), 1.0 / 3);
  KnownLoops loops;
  loops.add(108, 9);
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(0, loops), 0.5);
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(2, loops), 0.5) << "two laps are one other place";
  loops.add(211, 110);
  EXPECT_DOUBLE_EQ(sightings.distinctness_of(0, loops), 1);
}

TEST(KnownLoops, UnknownStepsAreTheirOwnFirstVisit) {
  KnownLoops loops;
  EXPECT_EQ(loops.first_visit(7), 7);
  loops.add(100, 20);
  EXPECT_EQ(loops.first_visit(20), 20);
  EXPECT_EQ(loops.first_visit(89), 89);
  EXPECT_EQ(loops.first_visit(111), 111);
}

TEST(KnownLoops, TheNearestLoopTells) {
  KnownLoops loops;
  loops.add(100, 20);
  loops.add(108, 30);
  EXPECT_EQ(loops.first_visit(90), 20);
  EXPECT_EQ(loops.first_visit(103), 20);
  EXPECT_EQ(loops.first_visit(105), 30);
  EXPECT_EQ(loops.first_visit(118), 30);
}

TEST(KnownLoops, AllVisitsAreFoundFromAnyLap) {
  KnownLoops loops;
  for (std::ptrdiff_t step = 100; step < 120; ++step) loops.add(step, step - 99);
  for (std::ptrdiff_t step = 200; step < 220; ++step) {
    KnownLoops found;
    found.add(step, step - 100);
    loops.take(found);
  }
  const auto visits = [&](std::ptrdiff_t step, std::ptrdiff_t end) {
    std::set<std::ptrdiff_t> steps;
    loops.for_each_visit(step, end, [&](std::ptrdiff_t s) { steps.insert(s); });
    return steps;
  };
  using Steps = std::set<std::ptrdiff_t>;
  const Steps first{107, 108, 109, 110, 111};  // and the steps beside
  const Steps second{207, 208, 209, 210, 211};
  Steps all = first;
  all.insert(second.begin(), second.end());
  EXPECT_EQ(visits(109, 500), all);
  all.insert(10);
  EXPECT_EQ(visits(10, 500), all);
  EXPECT_EQ(visits(10, 50), Steps{10});
  EXPECT_EQ(visits(60, 500), Steps{60});
  for (std::ptrdiff_t step = 200; step < 220; ++step) loops.remove(step, step - 100);
  EXPECT_EQ(visits(109, 500), first);
}

TEST(KnownLoops, LapsLeadBackToTheFirst) {
  KnownLoops loops;
  loops.add(100, 20);
  loops.add(200, 101);
  loops.add(-50, -90);
  EXPECT_EQ(loops.first_visit(201), 20);
  EXPECT_EQ(loops.first_visit(-51), -90) << "steps of earlier sessions are negative";
}

}  // namespace
}  // namespace loopbit::test
