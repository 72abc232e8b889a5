// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The search with bounds against a naive full scan, on maps of many stretches, with each kernel.
#include "pruned_search.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "loopbit/binary_content.hpp"
#include "loopbit/kernels_for.hpp"

#include "full_scan.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

void add_all(PlaceStore& store, const Contents& contents) {
  for (const BinaryContent& content : contents) store.add(content);
}

/// Settings that differ in all that the bounds and the floor depend on.
std::vector<RetrievalOptions> some_options() {
  return {
      {},
      {.max_candidates = 1, .min_similarity = 0.0, .shift_tolerance_columns = 0},
      {.max_candidates = 1000, .min_similarity = 0.0, .min_spacing = 1},
      {.max_candidates = 1000, .min_similarity = 0.4, .shift_tolerance_columns = 1},
      {.max_candidates = 5, .shift_tolerance_columns = 32, .min_spacing = 40},
      {.max_candidates = 3, .min_similarity = 0.0, .min_spacing = 1000},
      {.max_candidates = 7, .shift_tolerance_columns = 2, .max_center_distance_px = 3},
      {.max_candidates = 9, .shift_tolerance_columns = 8},
      {.min_similarity = 0.0, .max_center_distance_px = 0.8},
  };
}

/// Leaves out every third place, whole stretches, or nearly all places.
PlaceTest some_test(PlaceId number) {
  switch (number % 3) {
    case 0:
      return [](PlaceId place) { return place % 3 != 0; };
    case 1:
      return [](PlaceId place) { return place / 100 % 2 == 1; };
    default:
      return [](PlaceId place) { return place % 50 == 7; };
  }
}

class PrunedSearchTest : public testing::TestWithParam<InstructionSet> {
 protected:
  static void expect_as_full_scan(const Contents& places, const Contents& queries) {
    PlaceStore store;
    add_all(store, places);
    const PlaceId size = store.size();
    for (const BinaryContent& query : queries) {
      PlaceId end = size;
      for (const RetrievalOptions& options : some_options()) {
        for (const PlaceTest& is_allowed : {PlaceTest(), some_test(end)}) {
          PrunedSearch search(store, end, query, options, GetParam(), is_allowed);
          ASSERT_EQ(search.run(), full_scan(places, query, end, options, is_allowed))
              << "shift " << options.shift_tolerance_columns << ", spacing " << options.min_spacing
              << ", most " << options.max_candidates << ", end " << end << " of " << size;
        }
        end -= size / 37;  // ends anywhere within stretches of all lengths
      }
    }
  }
};

TEST_P(PrunedSearchTest, OfRandomPlaces) {
  Random random;
  const Contents places = random_contents(random, 1'300);
  expect_as_full_scan(places,
                      {places[800], shift_columns(places[30], 3), random_content(random, 0.3)});
}

TEST_P(PrunedSearchTest, OfACoherentSequence) {
  Random random;
  Contents places = coherent_contents(random, 1'400);
  const Contents again(places.begin() + 100, places.begin() + 400);  // a second lap
  places.insert(places.end(), again.begin(), again.end());
  expect_as_full_scan(places, {places[0], places[333], shift_columns(places[700], -2),
                               random_content(random, 0.2)});
}

TEST_P(PrunedSearchTest, OfEqualPlaces) {
  Random random;
  const BinaryContent content = random_content(random, 0.3);
  expect_as_full_scan(Contents(1'100, content), {content, random_content(random, 0.3)});
}

TEST_P(PrunedSearchTest, OfEmptyAndFullPlaces) {
  Random random;
  Contents places(600, full_content());
  places.resize(1'200);  // empty ones
  places.push_back(random_content(random, 0.5));
  places.resize(1'300, full_content());
  BinaryContent one_bit;
  one_bit.rows[20] = 16;
  expect_as_full_scan(places, {full_content(), random_content(random, 0.5), one_bit});
}

TEST_P(PrunedSearchTest, OfAlternatingPlaces) {
  Random random;
  const Contents two = random_contents(random, 2);
  Contents places;
  places.reserve(1'100);
  for (std::size_t i = 0; i < 1'100; ++i) places.push_back(two[i % 3 == 0 ? 0 : 1]);
  expect_as_full_scan(places, two);
}

/// A drive, a tour and a part of the drive again, slightly shifted.
Contents real_contents() {
  Contents contents;
  contents.reserve(900);
  for (std::size_t i = 0; i < 300; ++i) {
    contents.push_back(binary_content(real_image("kitti03/images", i)));
  }
  for (std::size_t i = 0; i < 300; ++i) {
    contents.push_back(binary_content(real_image("office_tour/images", i)));
  }
  for (std::size_t i = 0; i < 300; ++i) contents.push_back(shift_columns(contents[i], 1));
  return contents;
}

TEST_P(PrunedSearchTest, OfRealContents) {
  LOOPBIT_NEEDS_DATA("kitti03");
  LOOPBIT_NEEDS_DATA("office_tour");
  static const Contents contents = real_contents();
  expect_as_full_scan(contents, {contents[50], shift_columns(contents[500], 4),
                                 binary_content(real_image("kitti03/images", 350))});
}

TEST_P(PrunedSearchTest, AcrossChunksOfMemory) {
  Random random;
  const Contents places = coherent_contents(random, 66'200);
  PlaceStore store;
  add_all(store, places);
  for (const std::size_t query : {65'530U, 66'100U}) {
    PrunedSearch search(store, store.size(), places[query], {}, GetParam());
    ASSERT_EQ(search.run(), full_scan(places, places[query], store.size(), {}));
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, PrunedSearchTest, testing::ValuesIn(available_instruction_sets()),
                         [](const auto& set) { return std::string(to_string(set.param)); });

TEST(FoundPlaces, LeaveRoomForAPlaceThatKeepsSeveralOut) {
  FoundPlaces found({.max_candidates = 2, .min_similarity = 0.0, .min_spacing = 3});
  found.add({0, 0.8});
  found.add({3, 0.7});
  // These two are far enough apart for the answer, but a better one may yet keep both out.
  EXPECT_TRUE(found.may_matter(0.6, 10));
  found.add({2, 0.9});
  found.add({10, 0.6});
  EXPECT_EQ(std::move(found).answer(), (std::vector<Candidate>{{2, 0.9}, {10, 0.6}}));
}

TEST(FoundPlaces, LeaveOutWhatNoOrderOfThePlacesCanBring) {
  FoundPlaces found({.max_candidates = 2, .min_similarity = 0.0, .min_spacing = 3});
  found.add({0, 0.8});
  found.add({5, 0.7});
  EXPECT_FALSE(found.may_matter(0.699, 0));
  EXPECT_TRUE(found.may_matter(0.7, 4));
  EXPECT_FALSE(found.may_matter(0.7, 6));  // of equals, the earlier is in the answer
  EXPECT_TRUE(found.may_matter(0.701, 1'000));
}

TEST(FoundPlaces, NeedAsMuchOverlapAsTheFloorHas) {
  for (const double floor : {0.0, 0.2, 0.5, 1.0 / 3.0, 0.7, 1.0}) {
    const FoundPlaces found({.min_similarity = floor});
    for (int larger = 1; larger <= 4096; ++larger) {
      const int least = found.least_overlap(larger);
      ASSERT_FALSE(found.may_matter((least - 1.0) / larger, 0)) << floor << ' ' << larger;
      ASSERT_TRUE(found.may_matter((least + 1.0) / larger, 0)) << floor << ' ' << larger;
      for (const int overlap : {least - 1, least, least + 1}) {
        ASSERT_EQ(found.may_matter(overlap, larger, 0),
                  found.may_matter(static_cast<double>(overlap) / larger, 0))
            << floor << ' ' << overlap << " of " << larger;
      }
    }
  }
}

TEST(PrunedSearch, OfEqualPlacesLooksAtFew) {
  Random random;
  const BinaryContent content = random_content(random, 0.3);
  PlaceStore store;
  add_all(store, Contents(5'000, content));
  PrunedSearch search(store, store.size(), content, {.max_candidates = 20},
                      active_instruction_set());
  EXPECT_EQ(search.run().size(), 20U);
  EXPECT_LT(search.work().contents, 500);
}

TEST(PrunedSearch, WhereNearlyAllPlacesAreRefusedLooksAtThoseAllowed) {
  Random random;
  const Contents places = coherent_contents(random, 20'000);
  PlaceStore store;
  add_all(store, places);
  const PlaceTest is_allowed = [](PlaceId place) { return place / 50 == 77; };
  PrunedSearch search(store, store.size(), places[3'000], {}, active_instruction_set(), is_allowed);
  EXPECT_EQ(search.run(), full_scan(places, places[3'000], store.size(), {}, is_allowed));
  EXPECT_LT(search.work().contents, 3'000);
}

Stretch stretch_of(std::size_t number, int sum, int larger_count) {
  return {.number = static_cast<std::uint32_t>(number),
          .sum = static_cast<std::uint16_t>(sum),
          .larger_count = static_cast<std::uint16_t>(larger_count),
          .shifts = 1};
}

TEST(StretchQueue, GivesLargeBoundsFirstAndCoarseLevelsFirst) {
  StretchQueue queue;
  queue.push(1, stretch_of(7, 50, 100));
  queue.push(0, stretch_of(8, 50, 100));
  queue.push(3, stretch_of(9, 90, 100));
  queue.push(2, stretch_of(10, 120, 100));
  for (const auto& [level, number] : {std::pair{2U, 10U}, {3U, 9U}, {0U, 8U}, {1U, 7U}}) {
    std::vector<Stretch> taken;
    EXPECT_EQ(queue.pop(0.0, taken), level);
    ASSERT_EQ(taken.size(), 1U);
    EXPECT_EQ(taken.front().number, number);
  }
}

TEST(StretchQueue, GivesWhatReachesTheLeastBound) {
  StretchQueue queue;
  std::vector<Stretch> taken;
  queue.pop(0.0, taken);
  EXPECT_TRUE(taken.empty());
  for (const int larger : {1, 7, 64, 100, 817, 4096}) {
    for (int sum = 0; sum <= larger; ++sum) {
      const double bound = static_cast<double>(sum) / larger;
      queue.push(0, stretch_of(0, sum, larger));
      queue.pop(bound + 0.1, taken);
      ASSERT_TRUE(taken.empty()) << sum << " of " << larger;
      queue.pop(bound, taken);
      ASSERT_EQ(taken.size(), 1U) << sum << " of " << larger;
      ASSERT_EQ(taken.front().sum, sum);
    }
  }
}

TEST(StretchQueue, GivesEachStretchOnce) {
  Random random;
  StretchQueue queue;
  std::vector<Stretch> taken;
  std::vector<int> times(3'000);
  for (std::size_t i = 0; i < times.size(); ++i) {
    queue.push(i % 4, stretch_of(i, random.between(0, 500), 400));
    if (i % 10 != 0) continue;
    queue.pop(0.3, taken);
    for (const Stretch& stretch : taken) ++times[stretch.number];
  }
  do {
    queue.pop(0.0, taken);
    for (const Stretch& stretch : taken) ++times[stretch.number];
  } while (!taken.empty());
  EXPECT_EQ(times, std::vector<int>(times.size(), 1));
}

/// The sum of the minima as a kernel finds it for packed counts.
int packed_sum(const BlockCounts& query, const BlockCounts& counts) {
  const PackedCounts record = packed(counts);
  const std::uint8_t* address = record.of.data();
  const std::uint16_t among = 1;
  const std::uint16_t least = 0;
  Reached reached{};
  kernels_for<BoundKernels>(active_instruction_set())
      .reaching_queries(query.of.data(), &among, &address, 1, &least, &reached);
  return reached.largest_sum;
}

TEST(BlockCounts, BoundTheOverlap) {
  Random random;
  for (int i = 0; i < 200; ++i) {
    const BinaryContent a = random_content(random, random.uniform());
    const BinaryContent b = random_content(random, random.uniform());
    const BlockCounts of_a = block_counts(a);
    const BlockCounts of_b = block_counts(b);
    int sum = 0;
    int bound = 0;
    int expected_packed = 0;
    for (std::size_t k = 0; k < of_a.of.size(); ++k) {
      sum += of_a.of[k];
      bound += std::min(of_a.of[k], of_b.of[k]);
      expected_packed += of_b.of[k] == 15 ? of_a.of[k] : std::min(of_a.of[k], of_b.of[k]);
    }
    const CoarseCounts coarse_a = coarse_counts(of_a);
    const CoarseCounts coarse_b = coarse_counts(of_b);
    int coarse_sum = 0;
    int coarse_bound = 0;
    for (std::size_t k = 0; k < coarse_a.of.size(); ++k) {
      coarse_sum += coarse_a.of[k];
      coarse_bound += std::min(coarse_a.of[k], coarse_b.of[k]);
    }
    EXPECT_EQ(sum, count(a));
    EXPECT_EQ(coarse_sum, count(a));
    EXPECT_GE(bound, similarity(a, b) * std::max(count(a), count(b)));
    EXPECT_GE(coarse_bound, bound);
    EXPECT_EQ(packed_sum(of_a, of_b), expected_packed);
  }
}

}  // namespace
}  // namespace loopbit::test
