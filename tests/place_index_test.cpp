// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/place_index.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "test_support.hpp"

namespace loopbit::test {
namespace {

using Contents = std::vector<BinaryContent>;

PlaceIndex index_of(const Contents& contents) {
  PlaceIndex index;
  for (const BinaryContent& content : contents) index.add(content);
  return index;
}

/// A content with its first `bits` bits set.
BinaryContent first_bits(int bits) {
  BinaryContent content;
  for (int i = 0; i < bits; ++i) {
    content.rows[static_cast<std::size_t>(i / 64)] |= std::uint64_t{1} << (i % 64);
  }
  return content;
}

int overlap(const BinaryContent& a, const BinaryContent& b) {
  BinaryContent both;
  for (std::size_t y = 0; y < both.rows.size(); ++y) both.rows[y] = a.rows[y] & b.rows[y];
  return count(both);
}

double shifted_similarity(const BinaryContent& query, const BinaryContent& place, int tolerance) {
  int best = 0;
  for (int columns = -tolerance; columns <= tolerance; ++columns) {
    best = std::max(best, overlap(shift_columns(query, columns), place));
  }
  return best == 0 ? 0.0 : static_cast<double>(best) / std::max(count(query), count(place));
}

/// The rule as the header says it, without any shortcut: take the best place that is left and may
/// be taken, again and again.
std::vector<Candidate> full_scan(const Contents& places, const BinaryContent& query, PlaceId end,
                                 const RetrievalOptions& options) {
  std::vector<Candidate> left;
  for (PlaceId i = 0; i < end; ++i) {
    const double xi = shifted_similarity(query, places[static_cast<std::size_t>(i)],
                                         options.shift_tolerance_columns);
    if (xi > 0 && xi >= options.min_similarity) left.push_back({i, xi});
  }
  std::vector<Candidate> taken;
  while (!left.empty() && taken.size() < static_cast<std::size_t>(options.max_candidates)) {
    const Candidate best = *std::max_element(
        left.begin(), left.end(),
        [](const Candidate& a, const Candidate& b) { return a.similarity < b.similarity; });
    taken.push_back(best);
    std::erase_if(left, [&](const Candidate& other) {
      return std::abs(other.place - best.place) < options.min_spacing;
    });
  }
  return taken;
}

std::vector<RetrievalOptions> many_options() {
  std::vector<RetrievalOptions> all;
  for (const int shift : {0, 1, 4, 8}) {
    for (const int spacing : {1, 2, 5}) {
      for (const double min_similarity : {0.0, 0.2, 0.5, 1.0}) {
        for (const int most : {1, 7, 1000}) all.push_back({most, min_similarity, shift, spacing});
      }
    }
  }
  return all;
}

void expect_as_full_scan(const Contents& places, const Contents& queries) {
  const PlaceIndex index = index_of(places);
  for (const RetrievalOptions& options : many_options()) {
    for (const BinaryContent& query : queries) {
      for (const PlaceId end : {index.size(), index.size() / 2, 1}) {
        ASSERT_EQ(index.query(query, end, options), full_scan(places, query, end, options))
            << "shift " << options.shift_tolerance_columns << ", spacing " << options.min_spacing
            << ", min_similarity " << options.min_similarity << ", most " << options.max_candidates
            << ", end " << end;
      }
    }
  }
}

Contents random_contents(Random& random, int num_contents) {
  Contents contents;
  for (int i = 0; i < num_contents; ++i) {
    contents.push_back(random_content(random, 0.05 + 0.4 * random.uniform()));
  }
  return contents;
}

/// A camera's way: each content is the one before with some bits changed, now and then shifted.
Contents coherent_contents(Random& random, int num_contents) {
  Contents contents{random_content(random, 0.2)};
  while (contents.size() < static_cast<std::size_t>(num_contents)) {
    BinaryContent next = shift_columns(contents.back(), random.between(-1, 1));
    for (int change = 0; change < 40; ++change) {
      next.rows[static_cast<std::size_t>(random.between(0, 63))] ^= std::uint64_t{1}
                                                                    << random.between(0, 63);
    }
    contents.push_back(next);
  }
  return contents;
}

TEST(PlaceIndex, AnswersAsAFullScanOfRandomPlaces) {
  Random random;
  const Contents places = random_contents(random, 40);
  expect_as_full_scan(places,
                      {places[3], shift_columns(places[30], 5), random_contents(random, 1)[0]});
}

TEST(PlaceIndex, AnswersAsAFullScanOfACoherentSequence) {
  Random random;
  const Contents places = coherent_contents(random, 60);
  expect_as_full_scan(places, {places[0], places[33], places[59]});
}

TEST(PlaceIndex, AnswersAsAFullScanOfEqualPlaces) {
  Random random;
  const BinaryContent content = random_content(random, 0.3);
  expect_as_full_scan(Contents(30, content), {content, random_content(random, 0.3)});
}

TEST(PlaceIndex, AnswersAsAFullScanOfExtremePlaces) {
  Random random;
  Contents places(12, full_content());
  places.resize(24);  // empty ones
  places.push_back(first_bits(1));
  places.push_back(random_content(random, 0.5));
  expect_as_full_scan(places, {full_content(), first_bits(1), first_bits(2000), BinaryContent{}});
}

TEST(PlaceIndex, NumbersPlacesInTheOrderOfAdding) {
  PlaceIndex index;
  EXPECT_EQ(index.size(), 0);
  EXPECT_EQ(index.add(first_bits(1)), 0);
  EXPECT_EQ(index.add(first_bits(2)), 1);
  EXPECT_EQ(index.size(), 2);
  EXPECT_EQ(index.content(0), first_bits(1));
  EXPECT_EQ(index.content(1), first_bits(2));
}

TEST(PlaceIndex, ThrowsForPlacesItDoesNotHave) {
  const PlaceIndex index = index_of({first_bits(1), first_bits(2)});
  EXPECT_THROW(static_cast<void>(index.content(2)), std::out_of_range);
  EXPECT_THROW(static_cast<void>(index.content(-1)), std::out_of_range);
  EXPECT_THROW(static_cast<void>(PlaceIndex().content(0)), std::out_of_range);
}

TEST(PlaceIndex, LooksOnlyBelowTheEnd) {
  const PlaceIndex index = index_of(Contents(5, first_bits(9)));
  const RetrievalOptions options{.min_spacing = 1};
  EXPECT_TRUE(index.query(first_bits(9), 0, options).empty());
  EXPECT_TRUE(PlaceIndex().query(first_bits(9), 0, options).empty());
  EXPECT_EQ(index.query(first_bits(9), 2, options), (std::vector<Candidate>{{0, 1.0}, {1, 1.0}}));
}

TEST(PlaceIndex, EmptyContentsHaveAndAreNoCandidates) {
  const RetrievalOptions options{.min_similarity = 0.0, .min_spacing = 1};
  const PlaceIndex index = index_of({first_bits(100), BinaryContent{}, full_content()});
  EXPECT_TRUE(index.query(BinaryContent{}, 3, options).empty());
  const std::vector<Candidate> candidates = index.query(first_bits(100), 3, options);
  EXPECT_EQ(candidates, (std::vector<Candidate>{{0, 1.0}, {2, 100.0 / 4096.0}}));
}

TEST(PlaceIndex, OfEqualsTheEarlierComesFirst) {
  const PlaceIndex index =
      index_of({first_bits(50), first_bits(60), first_bits(60), first_bits(60)});
  EXPECT_EQ(index.query(first_bits(60), 4, {.min_spacing = 1}),
            (std::vector<Candidate>{{1, 1.0}, {2, 1.0}, {3, 1.0}, {0, 50.0 / 60.0}}));
}

TEST(PlaceIndex, BestPlaceOfAStretchKeepsItsNeighboursOut) {
  Contents places;
  for (const int bits : {80, 90, 100, 95, 85, 40}) places.push_back(first_bits(bits));
  const std::vector<Candidate> candidates =
      index_of(places).query(first_bits(100), 6, {.min_spacing = 3});
  EXPECT_EQ(candidates, (std::vector<Candidate>{{2, 1.0}, {5, 0.4}}));
}

TEST(PlaceIndex, ToleratesShiftsUpToTheOption) {
  Random random;
  const BinaryContent content = random_content(random, 0.2);
  const PlaceIndex index = index_of({content});
  for (const int columns : {-4, 4}) {
    const BinaryContent query = shift_columns(content, columns);
    // What left the map on one side is not there to overlap.
    const double expected = static_cast<double>(count(query)) / count(content);
    EXPECT_GT(expected, 0.9);
    const auto with = index.query(query, 1, {.shift_tolerance_columns = 4});
    ASSERT_EQ(with.size(), 1U);
    EXPECT_DOUBLE_EQ(with.front().similarity, expected);
    const auto without = index.query(query, 1, {.shift_tolerance_columns = 3});
    EXPECT_TRUE(without.empty() || without.front().similarity < 0.5);
  }
}

TEST(PlaceIndex, MinSimilarityItselfIsEnough) {
  const PlaceIndex index = index_of({first_bits(50)});
  EXPECT_EQ(index.query(first_bits(100), 1, {.min_similarity = 0.5}).size(), 1U);
  EXPECT_EQ(index.query(first_bits(101), 1, {.min_similarity = 0.5}).size(), 0U);
}

TEST(PlaceIndex, RefusesOptionsOutOfRange) {
  expect_error(ErrorKind::option, {"retrieval.max_candidates is 0", "1 and 1000"}, [] {
    static_cast<void>(PlaceIndex().query(full_content(), 0, {.max_candidates = 0}));
  });
}

}  // namespace
}  // namespace loopbit::test
