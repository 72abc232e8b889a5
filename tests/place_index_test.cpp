// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/place_index.hpp"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "full_scan.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

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

TEST(PlaceIndex, LimitsTheDistanceOfCenters) {
  BinaryContent query;
  query.rows[10] = 0xFF;
  BinaryContent lower = query;
  lower.rows[14] = 0xFF;  // its centre is 2 px below
  const PlaceIndex index = index_of({lower});
  EXPECT_EQ(index.query(query, 1, {.max_center_distance_px = 2.0}).size(), 1U);
  EXPECT_EQ(index.query(query, 1, {.max_center_distance_px = 1.999}).size(), 0U);
}

TEST(PlaceIndex, PlacesBeyondTheLimitKeepNobodyOut) {
  BinaryContent query;
  query.rows[10] = 0xFFFF;
  BinaryContent off_center = query;
  off_center.rows[63] = 1;
  BinaryContent smaller;
  smaller.rows[10] = 0x7FFE;
  const PlaceIndex index = index_of({off_center, smaller});
  // The first is more similar, but no candidate, and so its neighbour may be one.
  const RetrievalOptions options{.min_spacing = 2, .max_center_distance_px = 2.0};
  EXPECT_EQ(index.query(query, 2, options), (std::vector<Candidate>{{1, 0.875}}));
}

TEST(PlaceIndex, ContentsNeverMove) {
  PlaceIndex index = index_of({first_bits(1)});
  const BinaryContent* first = &index.content(0);
  for (int i = 0; i < 70'000; ++i) index.add(first_bits(2));
  EXPECT_EQ(&index.content(0), first);
  EXPECT_EQ(*first, first_bits(1));
  EXPECT_EQ(index.content(70'000), first_bits(2));
}

class PlaceIndexOnDisk : public ScratchTest {};

TEST_F(PlaceIndexOnDisk, AnswersAsTheOneInMemory) {
  Random random;
  const Contents places = coherent_contents(random, 2'000);
  PlaceIndex on_disk(path(""));
  for (const BinaryContent& content : places) on_disk.add(content);
  const PlaceIndex in_memory = index_of(places);
  for (const std::size_t query : {0U, 700U, 1999U}) {
    EXPECT_EQ(on_disk.query(places[query], 2'000), in_memory.query(places[query], 2'000));
    EXPECT_EQ(on_disk.content(static_cast<PlaceId>(query)), places[query]);
  }
}

TEST_F(PlaceIndexOnDisk, LeavesNothingBehind) {
  PlaceIndex index(path(""));
  index.add(first_bits(1));
  EXPECT_TRUE(std::filesystem::is_empty(path("")));
}

TEST_F(PlaceIndexOnDisk, SaysWhereItCannotWrite) {
  expect_error(ErrorKind::output, {path("missing")}, [&] { PlaceIndex index(path("missing")); });
}

TEST(PlaceIndex, TellsWhatItLookedAt) {
  Random random;
  const PlaceIndex index = index_of(coherent_contents(random, 1'030));
  RetrievalWork work;
  static_cast<void>(index.query(index.content(100), 1'030, {.max_candidates = 1}, &work));
  EXPECT_EQ(work.coarse_stretches, 32);  // whole groups of 16, of 32 places each
  EXPECT_GT(work.contents, 0);
  EXPECT_LT(work.contents, 300);
  static_cast<void>(index.query(BinaryContent{}, 1'030, {}, &work));
  EXPECT_EQ(work.coarse_stretches, 0);
  EXPECT_EQ(work.contents, 0);
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
