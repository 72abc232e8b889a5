// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "steady_displacements.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace loopbit {
namespace {

constexpr std::size_t kOthers = 20;
constexpr int kMiddle = Displacements::kRows / 2;

int square_at(int x, int y) { return Displacements::moved(0, x, y); }

/// A candidate with so many votes in one square, and a few displacements anywhere.
VerifiedCandidate candidate(std::ptrdiff_t step, int votes, int square, std::mt19937& random) {
  std::vector<int> bins(static_cast<std::size_t>(votes), square);
  for (int i = 0; i < 40; ++i) {
    const auto x = static_cast<int>(random() % 20);
    const auto y = static_cast<int>(random() % 20);
    bins.push_back(square_at(kMiddle - 10 + x, kMiddle - 10 + y));
  }
  return {.candidate = {},
          .step = step,
          .votes = {.count = votes, .square = square, .apart = Displacements(bins)}};
}

bool is_near(std::ptrdiff_t a, std::ptrdiff_t b) { return std::abs(a - b) <= 12; }

/// One place at `step` and places that look equally alike, elsewhere.
std::vector<VerifiedCandidate> seen(std::ptrdiff_t step, int votes, int square,
                                    std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<VerifiedCandidate> all{candidate(step, votes, square, random)};
  for (std::size_t i = 0; i < kOthers; ++i) {
    const auto other = 1000 + 50 * static_cast<std::ptrdiff_t>(i) + step;
    all.push_back(candidate(other, 0, square_at(kMiddle, kMiddle), random));
  }
  return all;
}

void commit(SteadyDisplacements& steady, const std::vector<VerifiedCandidate>& verified,
            const std::vector<std::pair<std::ptrdiff_t, double>>& wrong = {}) {
  SteadyDisplacements::Squares fullest;
  for (const VerifiedCandidate& v : verified) fullest.emplace_back(v.step, v.votes.square);
  steady.commit(steady.prepare(std::move(fullest), wrong));
}

std::optional<SteadyDisplacements::Seen> look(const SteadyDisplacements& steady,
                                              const std::vector<VerifiedCandidate>& verified,
                                              bool is_step = true) {
  return steady.look(verified, verified.size(), is_step, is_near).front();
}

TEST(SteadyDisplacements, AreExpectedOneOrTwoStepsFromThePlaceBefore) {
  SteadyDisplacements steady;
  const int square = square_at(kMiddle + 3, kMiddle - 1);
  EXPECT_FALSE(look(steady, seen(100, 6, square, 1)));
  commit(steady, seen(100, 6, square, 1));
  for (const std::ptrdiff_t step : {98, 99, 101, 102}) {
    const auto found = look(steady, seen(step, 6, square, 2));
    ASSERT_TRUE(found) << step;
    EXPECT_GT(found->ratio, 15) << step;
    EXPECT_GT(found->sigmas, 2.5) << step;
  }
  EXPECT_FALSE(look(steady, seen(97, 6, square, 2))) << "too far for one step";
  EXPECT_FALSE(look(steady, seen(100, 6, square, 2))) << "the same features once more";
}

TEST(SteadyDisplacements, MayChangeByOneBin) {
  SteadyDisplacements steady;
  const int square = square_at(kMiddle, kMiddle);
  commit(steady, seen(100, 6, square, 1));
  const auto ratio = [&](int right) {
    return look(steady, seen(101, 6, Displacements::moved(square, right, 0), 2))->ratio;
  };
  EXPECT_GT(ratio(0), ratio(2));
  EXPECT_GT(ratio(2), 3) << "two bins away, it still shares a square with one a bin away";
  EXPECT_LT(ratio(5), 2);
}

TEST(SteadyDisplacements, TheNullIsWhatPlacesElsewhereShowThere) {
  SteadyDisplacements steady;
  const int square = square_at(kMiddle, kMiddle);
  commit(steady, seen(100, 6, square, 1));
  auto verified = seen(101, 6, square, 2);
  std::mt19937 random(3);
  for (VerifiedCandidate& v : verified) {
    if (v.step != 101) v = candidate(v.step, 6, square, random);
  }
  EXPECT_LT(look(steady, verified)->ratio, 2) << "all move like this";
  for (VerifiedCandidate& v : verified) {
    if (v.step != 101) v.step = 101 + v.step % 12;
  }
  EXPECT_FALSE(look(steady, verified)) << "none is elsewhere";
}

TEST(SteadyDisplacements, AFrameThatIsNoStepFollowsTheStepBefore) {
  SteadyDisplacements steady;
  const int square = square_at(kMiddle, kMiddle);
  const int other = square_at(kMiddle + 8, kMiddle);
  commit(steady, seen(100, 6, square, 1));
  commit(steady, seen(101, 6, other, 2));
  EXPECT_GT(look(steady, seen(102, 6, other, 3), true)->ratio, 15);
  EXPECT_GT(look(steady, seen(101, 6, square, 3), false)->ratio, 15);
}

TEST(SteadyDisplacements, CountLessWhereWrongPlacesKeepTheirDeviation) {
  std::mt19937 random(4);
  std::normal_distribution<double> chance;
  SteadyDisplacements by_chance;
  SteadyDisplacements lasting;
  EXPECT_NEAR(by_chance.independence(), 1.0 / 3, 1e-9);
  for (std::ptrdiff_t i = 0; i < 100; ++i) {
    std::vector<std::pair<std::ptrdiff_t, double>> independent;
    std::vector<std::pair<std::ptrdiff_t, double>> kept;
    for (std::ptrdiff_t path = 0; path < 10; ++path) {
      independent.emplace_back(1000 * path + i, chance(random));
      kept.emplace_back(1000 * path + i, (path % 2 == 0 ? 1 : -1) + 0.5 * chance(random));
    }
    commit(by_chance, {}, independent);
    commit(lasting, {}, kept);
  }
  EXPECT_GT(by_chance.independence(), 0.6);
  EXPECT_LT(lasting.independence(), 0.15);
}

}  // namespace
}  // namespace loopbit
