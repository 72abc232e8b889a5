// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "wrong_paths.hpp"

#include <cstddef>
#include <random>

#include <gtest/gtest.h>

namespace loopbit {
namespace {

constexpr int kFrames = 300;

/// What is learned when `deviations_of(frame)` of wrong places follow each other.
template <typename DeviationsOf>
double independence_after(const DeviationsOf& deviations_of) {
  WrongPaths paths;
  for (int frame = 0; frame < kFrames; ++frame) paths.commit(paths.prepare(deviations_of(frame)));
  return paths.independence();
}

/// A street that looks like another one for 40 steps, and then another such street.
ByStep street(int frame) { return {{1000 * (frame / 40) + frame, 2.0}}; }

TEST(WrongPaths, StepsOfChanceAreIndependent) {
  std::mt19937 random(1);
  std::normal_distribution<double> chance;
  EXPECT_GT(independence_after([&](int frame) { return ByStep{{frame, chance(random)}}; }), 0.7);
}

TEST(WrongPaths, StepsOfAStreetThatLooksLikeAnotherCountLittle) {
  EXPECT_LT(independence_after(street), 0.1);
}

TEST(WrongPaths, AnInterruptedPathBeginsAgain) {
  const auto every_third = [](int frame) { return ByStep{{3 * frame, 2.0}}; };
  EXPECT_GT(independence_after(every_third), 0.75);
}

/// The same beside other places that show chance, so that the street's share of what is learned
/// decides. `seen(frame)`: what is seen of the street.
template <typename Seen>
double independence_among_others(const Seen& seen) {
  std::mt19937 random(1);
  std::normal_distribution<double> chance;
  return independence_after([&](int frame) {
    ByStep wrong = seen(frame);
    for (int i = 0; i < 20; ++i) wrong.emplace_back(100000 + 1000 * i + frame, chance(random));
    return wrong;
  });
}

TEST(WrongPaths, PlacesSideBySideAreOnePath) {
  const auto learned = [](std::ptrdiff_t beside) {
    return independence_among_others([&](int frame) {
      ByStep wrong;
      const auto [step, deviation] = street(frame).front();
      for (std::ptrdiff_t at = step - beside; at <= step + beside; ++at) {
        wrong.emplace_back(at, deviation);
      }
      return wrong;
    });
  };
  EXPECT_NEAR(learned(2), learned(0), 1e-3);
  EXPECT_LT(learned(7), learned(0) - 0.02) << "15 places are more than one path";
}

TEST(WrongPaths, WhatFormerSurroundingsTaughtFades) {
  std::mt19937 random(1);
  std::normal_distribution<double> chance;
  WrongPaths paths;
  for (int frame = 0; frame < 1000; ++frame) paths.commit(paths.prepare(street(frame)));
  EXPECT_LT(paths.independence(), 0.1);
  for (int frame = 0; frame < 800; ++frame) {
    ByStep wrong;
    for (int i = 0; i < 20; ++i) wrong.emplace_back(100000 + 1000 * i + frame, chance(random));
    paths.commit(paths.prepare(wrong));
  }
  EXPECT_GT(paths.independence(), 0.7);
}

TEST(WrongPaths, OfPlacesSideBySideTheLongestPathCounts) {
  // What is 3 steps ahead in every second frame only is no path.
  const auto with_another = [](int frame) {
    ByStep wrong = street(frame);
    if (frame % 2 == 1) wrong.emplace_back(wrong.front().first + 3, 0.0);
    return wrong;
  };
  EXPECT_NEAR(independence_among_others(with_another), independence_among_others(street), 1e-3);
}

}  // namespace
}  // namespace loopbit
