// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// The inner loops of every instruction set against slow code and against the scalar ones.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "loopbit/kernels_for.hpp"

#include "bound_kernels.hpp"
#include "epipolar_kernels.hpp"
#include "match_kernels.hpp"
#include "overlap_kernels.hpp"
#include "test_support.hpp"

namespace loopbit::test {
namespace {

using Words = std::vector<std::uint64_t>;
using Bytes = std::vector<std::int8_t>;

constexpr InstructionSet kScalar = InstructionSet::scalar;

Words random_words(Random& random, std::size_t contents) {
  Words words(contents * kContentWords);
  std::generate(words.begin(), words.end(), [&] { return random.bits(); });
  return words;
}

Bytes random_bytes(Random& random, std::size_t descriptors) {
  Bytes bytes(descriptors * kDescriptorSize);
  std::generate(bytes.begin(), bytes.end(),
                [&] { return static_cast<std::int8_t>(random.between(-127, 127)); });
  return bytes;
}

/// As describe() makes them: no sum of dx or dy is larger than that of |dx| or |dy|. Their squared
/// length comes near 2^16, and the values of a third of them lie in two columns of bins.
Bytes random_regular_bytes(Random& random, std::size_t descriptors) {
  Bytes bytes(descriptors * kDescriptorSize, 0);
  for (std::size_t i = 0; i < descriptors; ++i) {
    std::int8_t* descriptor = bytes.data() + i * kDescriptorSize;
    const std::size_t columns = i % 3 == 0 ? 2 : 4;
    for (int left = 65'535, tries = 0; tries < 500; ++tries) {
      const auto pick = [&](std::size_t end) {
        return static_cast<std::size_t>(random.between(0, static_cast<int>(end) - 1));
      };
      const std::size_t signed_value = 16 * pick(4) + 4 * pick(2) + pick(columns);
      std::int8_t& size = descriptor[signed_value + 8];
      const int larger = std::min(size + random.between(1, 40), 127);
      const int sum = random.between(-larger, larger);
      const int before = size * size + descriptor[signed_value] * descriptor[signed_value];
      const int after = larger * larger + sum * sum;
      if (after - before > left) continue;
      left -= after - before;
      size = static_cast<std::int8_t>(larger);
      descriptor[signed_value] = static_cast<std::int8_t>(sum);
    }
  }
  return bytes;
}

std::vector<std::uint16_t> max_overlaps(InstructionSet set, const Words& queries,
                                        const Words& places) {
  std::vector<std::uint16_t> overlaps(places.size() / kContentWords, 9999);
  kernels_for<OverlapKernels>(set).max_overlaps(queries.data(), queries.size() / kContentWords,
                                                places.data(), overlaps.size(), overlaps.data());
  return overlaps;
}

struct Neighbours {
  std::array<std::int32_t, kMatchLanes> index{};
  std::array<std::int32_t, kMatchLanes> distance_sq{};
  std::array<std::int32_t, kMatchLanes> second_distance_sq{};

  bool operator==(const Neighbours&) const = default;
};

/// Of kMatchLanes descriptors among `others`.
Neighbours nearest_two(InstructionSet set, const std::int8_t* descriptors,
                       const std::int8_t* others, std::size_t num_others) {
  std::vector<std::int32_t> constants(kMatchConstants * num_others + 1);
  kernels_for<MatchKernels>(set).describe_constants(others, num_others, constants.data());
  NearestTwo nearest;
  kernels_for<MatchKernels>(set).nearest_two(descriptors, others, constants.data(), num_others,
                                             nearest);
  Neighbours neighbours;
  std::copy_n(nearest.index, kMatchLanes, neighbours.index.begin());
  std::copy_n(nearest.distance_sq, kMatchLanes, neighbours.distance_sq.begin());
  std::copy_n(nearest.second_distance_sq, kMatchLanes, neighbours.second_distance_sq.begin());
  return neighbours;
}

Neighbours nearest_two(InstructionSet set, const Bytes& descriptors, const Bytes& others) {
  return nearest_two(set, descriptors.data(), others.data(), others.size() / kDescriptorSize);
}

std::int32_t distance_sq(const std::int8_t* a, const std::int8_t* b) {
  std::int32_t sum = 0;
  for (std::size_t k = 0; k < kDescriptorSize; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

/// What nearest_two has to find, from the definition: distances in order, stably.
Neighbours expected_neighbours(const Bytes& descriptors, const Bytes& others) {
  Neighbours expected;
  for (std::size_t lane = 0; lane < kMatchLanes; ++lane) {
    std::vector<std::pair<std::int32_t, std::int32_t>> order;
    for (std::size_t i = 0; i < others.size() / kDescriptorSize; ++i) {
      order.emplace_back(distance_sq(descriptors.data() + lane * kDescriptorSize,
                                     others.data() + i * kDescriptorSize),
                         static_cast<std::int32_t>(i));
    }
    std::sort(order.begin(), order.end());
    order.resize(std::max<std::size_t>(order.size(), 2), {NearestTwo::kNone, 0});
    expected.distance_sq[lane] = order[0].first;
    expected.index[lane] = order[0].second;
    expected.second_distance_sq[lane] = order[1].first;
  }
  if (others.size() == kDescriptorSize) {
    expected.second_distance_sq.fill(NearestTwo::kNone);
    expected.index.fill(0);
  }
  return expected;
}

using Counts = std::vector<std::uint8_t>;  // of several records, one after the other

Counts random_counts(Random& random, std::size_t num_counts, int largest) {
  Counts counts(num_counts);
  std::generate(counts.begin(), counts.end(),
                [&] { return static_cast<std::uint8_t>(random.between(0, largest)); });
  return counts;
}

/// Records of `size` counts side by side, `width` of them, `at_once` counts of each in turn.
Counts interleaved(const Counts& records, std::size_t size, std::size_t width,
                   std::size_t at_once) {
  Counts result(records.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    const std::size_t record = i / size;
    const std::size_t k = i % size;
    const std::size_t column = record % width * at_once + k % at_once;
    result[record / width * width * size + k / at_once * at_once * width + column] = records[i];
  }
  return result;
}

int sum_of_minima(const Counts& queries, std::size_t q, const Counts& records, std::size_t i,
                  std::size_t size) {
  int sum = 0;
  for (std::size_t k = 0; k < size; ++k) {
    sum += std::min(queries[q * size + k], records[i * size + k]);
  }
  return sum;
}

/// Records of block counts in [0, 16], packed; 15 becomes 16 in `records`, too.
Counts packed(Counts& records) {
  Counts result(records.size() / 2);
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (records[i] == 15) records[i] = 16;
    const unsigned code = std::min<unsigned>(records[i], 15);
    const std::size_t run = i / kPackedRun;
    result[run / 2 * kPackedRun + i % kPackedRun] |=
        static_cast<std::uint8_t>(run % 2 == 0 ? code : code << 4U);
  }
  return result;
}

/// What reaching_queries finds, from its definition; `records` are one after the other.
void expect_reaching_queries(InstructionSet set, const Counts& queries,
                             const std::vector<std::uint16_t>& among, Counts records,
                             const std::vector<std::uint16_t>& least) {
  const std::size_t num_records = records.size() / kBlockCounts;
  const Counts all_packed = packed(records);
  std::vector<const std::uint8_t*> addresses(num_records);
  for (std::size_t i = 0; i < num_records; ++i) addresses[i] = &all_packed[i * kPackedBytes];
  std::vector<Reached> reached(num_records, {9999, 9999});
  kernels_for<BoundKernels>(set).reaching_queries(queries.data(), among.data(), addresses.data(),
                                                  num_records, least.data(), reached.data());
  for (std::size_t i = 0; i < num_records; ++i) {
    int expected_largest = 0;
    unsigned expected = 0;
    for (std::size_t q = 0; q < queries.size() / kBlockCounts; ++q) {
      if ((unsigned{among[i / 2]} >> q & 1U) == 0) continue;
      const int sum = sum_of_minima(queries, q, records, i, kBlockCounts);
      expected_largest = std::max(expected_largest, sum);
      if (sum >= least[i]) expected |= 1U << q;
    }
    ASSERT_EQ(reached[i].largest_sum, expected_largest) << "record " << i << " of " << num_records;
    ASSERT_EQ(reached[i].queries, expected) << "record " << i << " of " << num_records;
  }
}

/// What coarse_sums finds, from its definition; `records` are one after the other.
void expect_coarse_sums(InstructionSet set, const Counts& queries, const Counts& records) {
  const std::size_t num_queries = queries.size() / kCoarseCounts;
  const std::size_t num_records = records.size() / kCoarseCounts;
  std::vector<std::uint16_t> sums(num_queries * num_records, 9999);
  std::vector<std::uint16_t> largest(num_records / kInterleaved, 9999);
  const Counts groups = interleaved(records, kCoarseCounts, kInterleaved, kCountsAtOnce);
  kernels_for<BoundKernels>(set).coarse_sums(queries.data(), num_queries, groups.data(),
                                             largest.size(), sums.data(), largest.data());
  std::vector<std::uint16_t> expected_largest(largest.size());
  for (std::size_t i = 0; i < num_records; ++i) {
    const std::size_t group = i / kInterleaved;
    for (std::size_t q = 0; q < num_queries; ++q) {
      const std::uint16_t sum = sums[(group * num_queries + q) * kInterleaved + i % kInterleaved];
      ASSERT_EQ(sum, sum_of_minima(queries, q, records, i, kCoarseCounts))
          << "query " << q << ", record " << i;
      expected_largest[group] = std::max(expected_largest[group], sum);
    }
  }
  EXPECT_EQ(largest, expected_largest);
}

/// Sums as coarse_sums leaves them, and what select_records has to know besides.
struct SumsOfRecords {
  std::size_t num_queries;
  std::vector<std::uint16_t> sums;
  std::vector<std::uint16_t> largest;
  std::vector<std::uint16_t> smallest_counts;

  [[nodiscard]] int sum(std::size_t q, std::size_t i) const {
    return sums[(i / kInterleaved * num_queries + q) * kInterleaved + i % kInterleaved];
  }
};

SumsOfRecords random_sums(Random& random, std::size_t num_queries, std::size_t num_groups) {
  const auto up_to_4096 = [&] { return static_cast<std::uint16_t>(random.between(0, 4096)); };
  SumsOfRecords records{num_queries, {}, {}, {}};
  for (std::size_t group = 0; group < num_groups; ++group) {
    std::uint16_t& largest = records.largest.emplace_back();
    for (std::size_t i = 0; i < num_queries * kInterleaved; ++i) {
      largest = std::max(largest, records.sums.emplace_back(up_to_4096()));
    }
    for (std::size_t i = 0; i < kInterleaved; ++i) records.smallest_counts.push_back(up_to_4096());
  }
  return records;
}

/// What select_records finds, from its definition.
void expect_selected(InstructionSet set, const SumsOfRecords& records, Selection selection) {
  selection.smallest_counts = records.smallest_counts.data();
  const std::size_t num_records = records.smallest_counts.size();
  std::vector<Selected> selected(num_records);
  selected.resize(kernels_for<BoundKernels>(set).select_records(
      records.sums.data(), records.largest.data(), records.num_queries, records.largest.size(),
      selection, selected.data()));
  auto found = selected.begin();
  for (std::size_t i = 0; i < num_records; ++i) {
    const int larger = std::max(selection.query_count, records.smallest_counts[i]);
    int best = 0;
    unsigned expected = 0;
    for (std::size_t q = 0; q < records.num_queries; ++q) {
      best = std::max(best, records.sum(q, i));
      if (records.sum(q, i) >= larger * selection.floor / 65'536) expected |= 1U << q;
    }
    if (best < selection.lower || best >= selection.upper || expected == 0) continue;
    ASSERT_NE(found, selected.end()) << "record " << i;
    ASSERT_EQ(found->record, i);
    ASSERT_EQ(found->queries, expected) << "record " << i;
    ++found;
  }
  EXPECT_EQ(found, selected.end());
}

/// Coordinates in [-2, 2).
float random_coordinate(Random& random) { return static_cast<float>(4 * random.uniform() - 2); }

PairSamples random_samples(Random& random) {
  PairSamples samples;
  for (auto* points :
       {&samples.x0, &samples.y0, &samples.z0, &samples.x1, &samples.y1, &samples.z1}) {
    for (auto& pair : *points) {
      std::generate(std::begin(pair), std::end(pair), [&] { return random_coordinate(random); });
    }
  }
  return samples;
}

cv::Matx33d matrix_at(const EpipolarPencils& pencils, std::size_t lane, double x) {
  cv::Matx33d matrix;
  for (std::size_t i = 0; i < 9; ++i) {
    matrix.val[i] = pencils.f[i][lane] + x * pencils.g[i][lane];
  }
  return matrix;
}

/// Random pairs, of which whatever lies behind the last one is not to be looked at.
struct RandomPairs {
  RandomPairs(Random& random, std::size_t count) : coordinates(8 * (count + kPairBlock)) {
    std::generate(coordinates.begin(), coordinates.end(),
                  [&] { return random_coordinate(random); });
    const std::size_t stride = count + kPairBlock;
    const auto array = [&](std::size_t i) { return coordinates.data() + i * stride; };
    for (std::size_t i = 0; i < 2 * stride; ++i) array(6)[i] = std::abs(array(6)[i]);
    pairs = {array(0), array(1), array(2), array(3), array(4), array(5), count};
    spreads = {array(6), array(7), 0.7F};
  }

  std::vector<float> coordinates;
  PointPairs pairs;
  RaySpreads spreads;
};

/// From the definition.
double sampson_sq(const std::array<float, 9>& model, const PointPairs& pairs, std::size_t i) {
  cv::Matx33d f;
  std::copy(model.begin(), model.end(), std::begin(f.val));
  const cv::Vec3d p(pairs.x0[i], pairs.y0[i], 1);
  const cv::Vec3d q(pairs.x1[i], pairs.y1[i], 1);
  const cv::Vec3d fp = f * p;
  const cv::Vec3d fq = f.t() * q;
  const double error = q.dot(fp);
  return error * error / (fp[0] * fp[0] + fp[1] * fp[1] + fq[0] * fq[0] + fq[1] * fq[1]);
}

/// The same for rays: an error is an angle, in pixels at both of them.
double sampson_sq(const std::array<float, 9>& model, const PointPairs& pairs,
                  const RaySpreads& spreads, std::size_t i) {
  cv::Matx33d e;
  std::copy(model.begin(), model.end(), std::begin(e.val));
  const cv::Vec3d p(pairs.x0[i], pairs.y0[i], pairs.z0[i]);
  const cv::Vec3d q(pairs.x1[i], pairs.y1[i], pairs.z1[i]);
  const auto size_sq = [&](const cv::Vec3d& normal) {
    return spreads.xy_scale_sq * (normal[0] * normal[0] + normal[1] * normal[1]) +
           normal[2] * normal[2];
  };
  const double error = q.dot(e * p);
  return error * error / (spreads.sq1[i] * size_sq(e * p) + spreads.sq0[i] * size_sq(e.t() * q));
}

class EveryKernel : public testing::TestWithParam<InstructionSet> {};

TEST_P(EveryKernel, CountsTheOverlapOfOneBit) {
  for (std::size_t word = 0; word < kContentWords; ++word) {
    for (std::size_t bit = 0; bit < 64; ++bit) {
      Words content(kContentWords, 0);
      content[word] = std::uint64_t{1} << bit;
      const Words full(kContentWords, ~std::uint64_t{0});
      ASSERT_EQ(max_overlaps(GetParam(), content, full).front(), 1) << word << ' ' << bit;
    }
  }
}

TEST_P(EveryKernel, FindsTheLargestOverlapOfSeveralQueries) {
  const Words empty(kContentWords, 0);
  const Words full(kContentWords, ~std::uint64_t{0});
  Words queries = empty;
  queries.insert(queries.end(), full.begin(), full.end());
  queries.insert(queries.end(), empty.begin(), empty.end());
  Words places = full;
  places.insert(places.end(), empty.begin(), empty.end());
  EXPECT_EQ(max_overlaps(GetParam(), queries, places), (std::vector<std::uint16_t>{4096, 0}));
  EXPECT_EQ(max_overlaps(GetParam(), {}, places), (std::vector<std::uint16_t>{0, 0}));
  EXPECT_TRUE(max_overlaps(GetParam(), queries, {}).empty());
}

TEST_P(EveryKernel, OverlapsEqualTheScalarOnes) {
  Random random;
  for (const std::size_t num_queries : {1U, 2U, 3U, 9U, 17U}) {
    for (const std::size_t num_places : {1U, 2U, 3U, 7U, 8U, 33U, 100U}) {
      const Words queries = random_words(random, num_queries);
      const Words places = random_words(random, num_places);
      ASSERT_EQ(max_overlaps(GetParam(), queries, places), max_overlaps(kScalar, queries, places))
          << num_queries << " queries, " << num_places << " places";
    }
  }
}

TEST_P(EveryKernel, ReadsContentsAtAnyWord) {
  Random random;
  const Words queries = random_words(random, 4);
  const Words places = random_words(random, 6);
  for (std::size_t shift = 0; shift < 8; ++shift) {
    std::array<std::uint16_t, 5> overlaps{};
    std::array<std::uint16_t, 5> expected{};
    kernels_for<OverlapKernels>(GetParam())
        .max_overlaps(queries.data() + shift, 3, places.data() + 8 - shift, 5, overlaps.data());
    kernels_for<OverlapKernels>(kScalar).max_overlaps(
        queries.data() + shift, 3, places.data() + 8 - shift, 5, expected.data());
    EXPECT_EQ(overlaps, expected) << "from word " << shift;
  }
}

TEST_P(EveryKernel, FindsTheNearestTwoAmongAnyNumber) {
  Random random;
  for (const std::size_t num_others :
       {1U, 2U, 3U, 4U, 5U, 7U, 8U, 12U, 31U, 64U, 256U, 257U, 601U}) {
    const Bytes descriptors = random_bytes(random, kMatchLanes);
    const Bytes others = random_bytes(random, num_others);
    ASSERT_EQ(nearest_two(GetParam(), descriptors, others),
              expected_neighbours(descriptors, others))
        << num_others << " others";
  }
}

TEST_P(EveryKernel, FindsTheNearestTwoOfRegularDescriptors) {
  Random random;
  for (const std::size_t num_others : {1U, 2U, 3U, 4U, 5U, 7U, 8U, 12U, 31U, 257U, 601U}) {
    const Bytes descriptors = random_regular_bytes(random, kMatchLanes);
    Bytes others = random_regular_bytes(random, num_others);
    std::copy_n(descriptors.begin(), kDescriptorSize, others.end() - kDescriptorSize);
    ASSERT_EQ(nearest_two(GetParam(), descriptors, others),
              expected_neighbours(descriptors, others))
        << num_others << " others";
  }
}

TEST_P(EveryKernel, OneDescriptorMayBeIrregular) {
  Random random;
  const Bytes descriptors = random_regular_bytes(random, kMatchLanes);
  const Bytes others = random_regular_bytes(random, 20);
  // A sum above that of magnitudes, then one of negative magnitudes, then too long a descriptor.
  std::vector<Bytes> irregular(3, Bytes(kDescriptorSize, 0));
  irregular[0][16] = 127;
  irregular[1][8] = -127;
  std::fill_n(irregular[2].begin(), kDescriptorSize, std::int8_t{127});
  for (const Bytes& bytes : irregular) {
    for (const std::size_t at : {0U, 9U, 15U}) {
      Bytes with = descriptors;
      std::copy(bytes.begin(), bytes.end(), with.data() + at * kDescriptorSize);
      ASSERT_EQ(nearest_two(GetParam(), with, others), expected_neighbours(with, others));
      Bytes among = others;
      std::copy(bytes.begin(), bytes.end(), among.data() + at * kDescriptorSize);
      ASSERT_EQ(nearest_two(GetParam(), descriptors, among),
                expected_neighbours(descriptors, among));
      ASSERT_EQ(nearest_two(GetParam(), with, among), expected_neighbours(with, among));
    }
  }
}

TEST_P(EveryKernel, FirstOfEquallyNearOnesIsNearest) {
  Random random;
  for (const std::size_t num_between : {0U, 300U}) {
    const Bytes descriptors = random_bytes(random, kMatchLanes);
    const Bytes between = random_bytes(random, num_between);
    Bytes others = random_bytes(random, 3);
    others.insert(others.end(), descriptors.begin(), descriptors.end());
    others.insert(others.end(), between.begin(), between.end());
    others.insert(others.end(), descriptors.begin(), descriptors.end());
    const Neighbours found = nearest_two(GetParam(), descriptors, others);
    EXPECT_EQ(found, expected_neighbours(descriptors, others));
    for (std::size_t lane = 0; lane < kMatchLanes; ++lane) {
      EXPECT_EQ(found.index[lane], static_cast<int>(lane) + 3);
      EXPECT_EQ(found.distance_sq[lane], 0);
      EXPECT_EQ(found.second_distance_sq[lane], 0);
    }
  }
}

TEST_P(EveryKernel, MeasuresTheLargestDistances) {
  const Bytes highest(kMatchLanes * kDescriptorSize, 127);
  Bytes others(kDescriptorSize, -127);
  others.insert(others.end(), kDescriptorSize, 0);
  const Neighbours found = nearest_two(GetParam(), highest, others);
  EXPECT_EQ(found.index[0], 1);
  EXPECT_EQ(found.distance_sq[0], 64 * 127 * 127);
  EXPECT_EQ(found.second_distance_sq[0], 64 * 254 * 254);
}

TEST_P(EveryKernel, ComparesEachValueWithItsLike) {
  for (std::size_t i = 0; i < kDescriptorSize; ++i) {
    Bytes one(kMatchLanes * kDescriptorSize, 0);
    one[5 * kDescriptorSize + i] = -3;
    Bytes rising(kDescriptorSize);
    for (std::size_t k = 0; k < kDescriptorSize; ++k) rising[k] = static_cast<std::int8_t>(k + 1);
    const Neighbours found = nearest_two(GetParam(), one, rising);
    const int square = 64 * 65 * 129 / 6;
    ASSERT_EQ(found.distance_sq[4], square);
    ASSERT_EQ(found.distance_sq[5], square + 9 + 6 * static_cast<int>(i + 1));
  }
}

TEST_P(EveryKernel, WithoutOthersThereIsNoNeighbour) {
  Random random;
  const Neighbours found = nearest_two(GetParam(), random_bytes(random, kMatchLanes), {});
  for (const std::int32_t distance : found.distance_sq) EXPECT_EQ(distance, NearestTwo::kNone);
  for (const std::int32_t second : found.second_distance_sq) EXPECT_EQ(second, NearestTwo::kNone);
}

TEST_P(EveryKernel, ReadsDescriptorsAtAnyByte) {
  Random random;
  const Bytes descriptors = random_bytes(random, kMatchLanes + 1);
  const Bytes others = random_bytes(random, 7);
  for (std::size_t shift = 0; shift < kDescriptorSize; ++shift) {
    const auto found = [&](InstructionSet set) {
      return nearest_two(set, descriptors.data() + shift, others.data() + kDescriptorSize - shift,
                         6);
    };
    EXPECT_EQ(found(GetParam()), found(kScalar)) << "from byte " << shift;
  }
}

TEST_P(EveryKernel, SumsTheMinimaOfEachPairOfCounts) {
  for (std::size_t k = 0; k < kBlockCounts; ++k) {
    Counts two(2 * kBlockCounts, 0);
    two[k] = 14;
    two[kBlockCounts + k] = 5;
    const Counts full(kBlockCounts, 16);
    expect_reaching_queries(GetParam(), full, {1}, two, {14, 6});
  }
  for (std::size_t k = 0; k < kCoarseCounts * kInterleaved; ++k) {
    Counts one(kCoarseCounts * kInterleaved, 0);
    one[k] = 50;
    expect_coarse_sums(GetParam(), Counts(kCoarseCounts, 64), one);
  }
}

TEST_P(EveryKernel, SumsTheLargestCounts) {
  const Counts full(4 * kBlockCounts, 16);
  expect_reaching_queries(GetParam(), full, {0b1111, 0b0101}, full, {4096, 4095, 4097, 0});
  expect_reaching_queries(GetParam(), full, {0, 0b1000}, full, {0, 1, 2, 3});
  const Counts full_groups(2 * kInterleaved * kCoarseCounts, 64);
  expect_coarse_sums(GetParam(), Counts(3 * kCoarseCounts, 64), full_groups);
  expect_coarse_sums(GetParam(), {}, full_groups);
  expect_coarse_sums(GetParam(), full, {});
}

TEST_P(EveryKernel, TakesA15InARecordFor16) {
  const Counts query(kBlockCounts, 16);
  const Counts record(kBlockCounts, 15);
  expect_reaching_queries(GetParam(), query, {1}, record, {4096});
  expect_reaching_queries(GetParam(), Counts(kBlockCounts, 15), {1}, record, {15 * 256});
}

TEST_P(EveryKernel, SumsCoarseCountsWhereQueriesHaveAny) {
  Random random;
  const Counts records = random_counts(random, kInterleaved * kCoarseCounts, 64);
  for (std::size_t filled = 1; filled <= kCoarseCounts; ++filled) {
    Counts queries(2 * kCoarseCounts, 0);
    queries[filled - 1] = 64;
    for (std::size_t k = kCoarseCounts - filled; k < kCoarseCounts; ++k) {
      queries[kCoarseCounts + k] = 40;
    }
    expect_coarse_sums(GetParam(), queries, records);
  }
}

TEST_P(EveryKernel, FindsTheQueriesThatReachWhatARecordNeeds) {
  Random random;
  for (const int largest : {3, 16}) {
    for (const std::size_t num_records : {0U, 1U, 2U, 3U, 4U, 15U, 32U}) {
      for (const std::uint32_t of_first : {0x1U, 0x1FFU, 0x124U, 0x8001U, 0xFFFFU}) {
        const Counts queries = random_counts(random, 16 * kBlockCounts, largest);
        const Counts records = random_counts(random, num_records * kBlockCounts, largest);
        std::vector<std::uint16_t> among((num_records + 1) / 2);
        for (std::size_t i = 0; i < among.size(); ++i) {
          among[i] = static_cast<std::uint16_t>(of_first << i | of_first >> (16 - i));
        }
        std::vector<std::uint16_t> least(num_records);
        // Some records need just what one of the queries has.
        for (std::size_t i = 0; i < least.size(); ++i) {
          least[i] = static_cast<std::uint16_t>(
              sum_of_minima(queries, i % 9, records, i, kBlockCounts) + random.between(0, 1));
        }
        expect_reaching_queries(GetParam(), queries, among, records, least);
      }
    }
  }
}

TEST_P(EveryKernel, SumsTheMinimaOfCoarseCounts) {
  Random random;
  for (const int largest : {3, 64}) {
    for (const std::size_t num_queries : {1U, 2U, 3U, 4U, 5U, 6U, 9U, 16U}) {
      for (const std::size_t num_groups : {1U, 2U, 5U}) {
        expect_coarse_sums(
            GetParam(), random_counts(random, num_queries * kCoarseCounts, largest),
            random_counts(random, num_groups * kInterleaved * kCoarseCounts, largest));
      }
    }
  }
}

TEST_P(EveryKernel, SelectsRecordsWithinLimitsThatQueriesReach) {
  Random random;
  for (const std::size_t num_queries : {1U, 5U, 16U}) {
    SumsOfRecords records = random_sums(random, num_queries, 5);
    std::fill_n(records.sums.begin(), num_queries * kInterleaved, std::uint16_t{1});
    std::fill_n(records.sums.end() - kInterleaved, kInterleaved, std::uint16_t{4096});
    records.largest.front() = 1;
    records.largest.back() = 4096;
    for (const auto& [lower, upper] :
         {std::pair{0, 32'767}, {1, 4097}, {1, 1}, {2000, 3000}, {4000, 4096}, {4096, 4097}}) {
      for (const int floor : {0, 1, 30'000, 50'000, 65'535}) {
        for (const int query_count : {1, 2500, 4096}) {
          expect_selected(GetParam(), records,
                          {.lower = static_cast<std::uint16_t>(lower),
                           .upper = static_cast<std::uint16_t>(upper),
                           .query_count = static_cast<std::uint16_t>(query_count),
                           .floor = static_cast<std::uint16_t>(floor)});
        }
      }
    }
  }
  EXPECT_EQ(kernels_for<BoundKernels>(GetParam())
                .select_records(nullptr, nullptr, 5, 0, {.lower = 1, .upper = 2}, nullptr),
            0U);
}

TEST_P(EveryKernel, SelectsRecordsWhoseSumIsJustWhatIsNeeded) {
  SumsOfRecords records{1,
                        std::vector<std::uint16_t>(kInterleaved),
                        {2049},
                        std::vector<std::uint16_t>(kInterleaved, 4096)};
  // Half of 4096 is needed, half of 4095 rounded down, of the query's 100.
  records.smallest_counts[1] = 4095;
  records.smallest_counts[2] = 99;
  for (const int less : {0, 1}) {
    records.sums[0] = static_cast<std::uint16_t>(2048 - less);
    records.sums[1] = static_cast<std::uint16_t>(2047 - less);
    records.sums[2] = static_cast<std::uint16_t>(50 - less);
    expect_selected(GetParam(), records,
                    {.lower = 1, .upper = 4097, .query_count = 100, .floor = 32'768});
  }
}

TEST_P(EveryKernel, SolvesSamplesOfSevenPairs) {
  Random random;
  for (int run = 0; run < 20; ++run) {
    const PairSamples samples = random_samples(random);
    EpipolarPencils pencils;
    kernels_for<EpipolarKernels>(GetParam()).solve_samples(samples, pencils);
    for (std::size_t lane = 0; lane < kSampleLanes; ++lane) {
      ASSERT_EQ(pencils.is_determined[lane], 1);
      for (const double x : {-1.5, 0.0, 0.3, 2.0}) {
        const cv::Matx33d matrix = matrix_at(pencils, lane, x);
        const double size = cv::norm(matrix);
        for (std::size_t k = 0; k < kSamplePairs; ++k) {
          const cv::Vec3d p(samples.x0[k][lane], samples.y0[k][lane], samples.z0[k][lane]);
          const cv::Vec3d q(samples.x1[k][lane], samples.y1[k][lane], samples.z1[k][lane]);
          ASSERT_NEAR(q.dot(matrix * p) / size, 0, 1e-6) << "pair " << k << " at " << x;
        }
        const auto& power = pencils.determinant;
        const double determinant =
            ((power[3][lane] * x + power[2][lane]) * x + power[1][lane]) * x + power[0][lane];
        ASSERT_NEAR(determinant / (size * size * size),
                    cv::determinant(matrix) / (size * size * size), 1e-9);
      }
    }
  }
}

TEST_P(EveryKernel, PencilsEqualTheScalarOnes) {
  Random random;
  for (int run = 0; run < 100; ++run) {
    const PairSamples samples = random_samples(random);
    EpipolarPencils pencils;
    EpipolarPencils expected;
    kernels_for<EpipolarKernels>(GetParam()).solve_samples(samples, pencils);
    kernels_for<EpipolarKernels>(kScalar).solve_samples(samples, expected);
    for (std::size_t lane = 0; lane < kSampleLanes; ++lane) {
      for (std::size_t i = 0; i < 9; ++i) {
        ASSERT_EQ(pencils.f[i][lane], expected.f[i][lane]);
        ASSERT_EQ(pencils.g[i][lane], expected.g[i][lane]);
      }
      for (std::size_t i = 0; i < 4; ++i) {
        ASSERT_EQ(pencils.determinant[i][lane], expected.determinant[i][lane]);
      }
    }
  }
}

TEST_P(EveryKernel, TellsWhichSamplesDetermineNothing) {
  Random random;
  PairSamples samples = random_samples(random);
  for (auto* points :
       {&samples.x0, &samples.y0, &samples.z0, &samples.x1, &samples.y1, &samples.z1}) {
    for (auto& pair : *points) {
      pair[2] = 0.5F;                                 // one pair, seven times
      pair[5] = points == &samples.x0 ? 0 : pair[5];  // all on one line through the origin
    }
  }
  EpipolarPencils pencils;
  kernels_for<EpipolarKernels>(GetParam()).solve_samples(samples, pencils);
  for (std::size_t lane = 0; lane < kSampleLanes; ++lane) {
    EXPECT_EQ(pencils.is_determined[lane], lane == 2 || lane == 5 ? 0 : 1) << lane;
  }
}

TEST_P(EveryKernel, ScoresPairsBySampsonsDistance) {
  constexpr float kMaxErrorSq = 0.3F;
  Random random;
  for (const std::size_t count : {0U, 1U, 15U, 16U, 17U, 100U}) {
    const RandomPairs random_pairs(random, count);
    const PointPairs& pairs = random_pairs.pairs;
    std::array<float, 9> model{};
    std::generate(model.begin(), model.end(), [&] { return random_coordinate(random); });
    std::vector<std::uint8_t> is_inlier(count + kPairBlock, 9);
    const EpipolarScore score =
        kernels_for<EpipolarKernels>(GetParam())
            .epipolar_score(model.data(), pairs, kMaxErrorSq, is_inlier.data());
    double cost = 0;
    int inliers = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double distance_sq = sampson_sq(model, pairs, i);
      cost += std::min<double>(distance_sq, kMaxErrorSq);
      inliers += distance_sq < kMaxErrorSq ? 1 : 0;
      EXPECT_EQ(is_inlier[i], distance_sq < kMaxErrorSq ? 1 : 0) << i << " of " << count;
    }
    EXPECT_EQ(score.inliers, inliers) << count;
    EXPECT_NEAR(score.cost, cost, 1e-4) << count;

    std::vector<std::uint8_t> expected_inliers(is_inlier.size(), 9);
    const EpipolarScore expected = kernels_for<EpipolarKernels>(kScalar).epipolar_score(
        model.data(), pairs, kMaxErrorSq, expected_inliers.data());
    EXPECT_EQ(score.cost, expected.cost);
    EXPECT_EQ(is_inlier, expected_inliers);
  }
}

TEST_P(EveryKernel, ScoresRaysByAngles) {
  constexpr float kMaxErrorSq = 0.3F;
  Random random;
  for (const std::size_t count : {0U, 1U, 15U, 16U, 17U, 100U}) {
    const RandomPairs rays(random, count);
    std::array<float, 9> model{};
    std::generate(model.begin(), model.end(), [&] { return random_coordinate(random); });
    std::vector<std::uint8_t> is_inlier(count + kPairBlock, 9);
    const EpipolarScore score =
        kernels_for<EpipolarKernels>(GetParam())
            .ray_score(model.data(), rays.pairs, rays.spreads, kMaxErrorSq, is_inlier.data());
    double cost = 0;
    int inliers = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double distance_sq = sampson_sq(model, rays.pairs, rays.spreads, i);
      cost += std::min<double>(distance_sq, kMaxErrorSq);
      inliers += distance_sq < kMaxErrorSq ? 1 : 0;
      EXPECT_EQ(is_inlier[i], distance_sq < kMaxErrorSq ? 1 : 0) << i << " of " << count;
    }
    EXPECT_EQ(score.inliers, inliers) << count;
    EXPECT_NEAR(score.cost, cost, 1e-4) << count;

    std::vector<std::uint8_t> expected_inliers(is_inlier.size(), 9);
    const EpipolarScore expected = kernels_for<EpipolarKernels>(kScalar).ray_score(
        model.data(), rays.pairs, rays.spreads, kMaxErrorSq, expected_inliers.data());
    EXPECT_EQ(score.cost, expected.cost);
    EXPECT_EQ(is_inlier, expected_inliers);
  }
}

TEST_P(EveryKernel, WithoutGradientThereIsNoInlier) {
  Random random;
  const RandomPairs random_pairs(random, 3);
  const std::array<float, 9> nothing{};
  std::vector<std::uint8_t> is_inlier(kPairBlock, 9);
  const EpipolarScore score =
      kernels_for<EpipolarKernels>(GetParam())
          .epipolar_score(nothing.data(), random_pairs.pairs, 0.5F, is_inlier.data());
  EXPECT_EQ(score.inliers, 0);
  EXPECT_EQ(score.cost, 1.5F);
  const EpipolarScore of_rays = kernels_for<EpipolarKernels>(GetParam())
                                    .ray_score(nothing.data(), random_pairs.pairs,
                                               random_pairs.spreads, 0.5F, is_inlier.data());
  EXPECT_EQ(of_rays.inliers, 0);
  EXPECT_EQ(of_rays.cost, 1.5F);
}

INSTANTIATE_TEST_SUITE_P(Kernels, EveryKernel, testing::ValuesIn(available_instruction_sets()),
                         [](const auto& set) { return std::string(to_string(set.param)); });

TEST(Kernels, ScalarIsAlwaysThereAndFirst) {
  EXPECT_EQ(available_instruction_sets().front(), kScalar);
}

TEST(Kernels, ActiveIsTheFastestUnlessAnotherIsForced) {
  const char* forced = std::getenv("LOOPBIT_KERNEL");
  EXPECT_EQ(to_string(active_instruction_set()),
            forced == nullptr ? to_string(available_instruction_sets().back()) : forced);
}

}  // namespace
}  // namespace loopbit::test
