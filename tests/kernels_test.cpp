// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/kernels.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "test_support.hpp"

namespace loopbit::test {
namespace {

using Words = std::vector<std::uint64_t>;
using Bytes = std::vector<std::int8_t>;

const Kernels& scalar() { return *available_kernels().front(); }

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

std::vector<std::uint16_t> max_overlaps(const Kernels& kernels, const Words& queries,
                                        const Words& places) {
  std::vector<std::uint16_t> overlaps(places.size() / kContentWords, 9999);
  kernels.max_overlaps(queries.data(), queries.size() / kContentWords, places.data(),
                       overlaps.size(), overlaps.data());
  return overlaps;
}

std::vector<std::int32_t> dot_products(const Kernels& kernels, const Bytes& descriptor,
                                       const Bytes& descriptors) {
  std::vector<std::int32_t> products(descriptors.size() / kDescriptorSize, -9999);
  kernels.dot_products(descriptor.data(), descriptors.data(), products.size(), products.data());
  return products;
}

/// Counts as blocks have them, or up to the largest a kernel may be given.
std::vector<std::uint8_t> random_counts(Random& random, std::size_t records, int largest) {
  std::vector<std::uint8_t> counts(records * kBlockCounts);
  std::generate(counts.begin(), counts.end(),
                [&] { return static_cast<std::uint8_t>(random.between(0, largest)); });
  return counts;
}

std::vector<std::uint16_t> max_min_sums(const Kernels& kernels,
                                        const std::vector<std::uint8_t>& queries,
                                        const std::vector<std::uint8_t>& records) {
  std::vector<std::uint16_t> largest(records.size() / kBlockCounts, 9999);
  kernels.max_min_sums(queries.data(), queries.size() / kBlockCounts, records.data(),
                       largest.size(), largest.data());
  return largest;
}

class EveryKernel : public testing::TestWithParam<const Kernels*> {};

TEST_P(EveryKernel, CountsTheOverlapOfOneBit) {
  for (std::size_t word = 0; word < kContentWords; ++word) {
    for (std::size_t bit = 0; bit < 64; ++bit) {
      Words content(kContentWords, 0);
      content[word] = std::uint64_t{1} << bit;
      const Words full(kContentWords, ~std::uint64_t{0});
      ASSERT_EQ(max_overlaps(*GetParam(), content, full).front(), 1) << word << ' ' << bit;
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
  EXPECT_EQ(max_overlaps(*GetParam(), queries, places), (std::vector<std::uint16_t>{4096, 0}));
  EXPECT_EQ(max_overlaps(*GetParam(), {}, places), (std::vector<std::uint16_t>{0, 0}));
  EXPECT_TRUE(max_overlaps(*GetParam(), queries, {}).empty());
}

TEST_P(EveryKernel, OverlapsEqualTheScalarOnes) {
  Random random;
  for (const std::size_t num_queries : {1U, 2U, 3U, 9U, 17U}) {
    for (const std::size_t num_places : {1U, 2U, 3U, 7U, 8U, 33U, 100U}) {
      const Words queries = random_words(random, num_queries);
      const Words places = random_words(random, num_places);
      ASSERT_EQ(max_overlaps(*GetParam(), queries, places), max_overlaps(scalar(), queries, places))
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
    GetParam()->max_overlaps(queries.data() + shift, 3, places.data() + 8 - shift, 5,
                             overlaps.data());
    scalar().max_overlaps(queries.data() + shift, 3, places.data() + 8 - shift, 5, expected.data());
    EXPECT_EQ(overlaps, expected) << "from word " << shift;
  }
}

TEST_P(EveryKernel, MultipliesTheLargestDescriptors) {
  const Bytes highest(kDescriptorSize, 127);
  Bytes others = highest;
  others.insert(others.end(), kDescriptorSize, -127);
  others.insert(others.end(), kDescriptorSize, 0);
  constexpr int kLargest = 64 * 127 * 127;
  EXPECT_EQ(dot_products(*GetParam(), highest, others),
            (std::vector<std::int32_t>{kLargest, -kLargest, 0}));
  EXPECT_TRUE(dot_products(*GetParam(), highest, {}).empty());
}

TEST_P(EveryKernel, MultipliesEachValueWithItsLike) {
  for (std::size_t i = 0; i < kDescriptorSize; ++i) {
    Bytes one(kDescriptorSize, 0);
    one[i] = -3;
    Bytes rising(kDescriptorSize);
    for (std::size_t k = 0; k < kDescriptorSize; ++k) rising[k] = static_cast<std::int8_t>(k + 1);
    ASSERT_EQ(dot_products(*GetParam(), one, rising).front(), -3 * static_cast<int>(i + 1));
  }
}

TEST_P(EveryKernel, ProductsEqualTheScalarOnes) {
  Random random;
  for (const std::size_t num_descriptors : {1U, 2U, 3U, 4U, 5U, 31U, 64U, 701U}) {
    const Bytes descriptor = random_bytes(random, 1);
    const Bytes descriptors = random_bytes(random, num_descriptors);
    ASSERT_EQ(dot_products(*GetParam(), descriptor, descriptors),
              dot_products(scalar(), descriptor, descriptors))
        << num_descriptors << " descriptors";
  }
}

TEST_P(EveryKernel, ReadsDescriptorsAtAnyByte) {
  Random random;
  const Bytes descriptor = random_bytes(random, 2);
  const Bytes descriptors = random_bytes(random, 6);
  for (std::size_t shift = 0; shift < kDescriptorSize; ++shift) {
    std::array<std::int32_t, 5> products{};
    std::array<std::int32_t, 5> expected{};
    GetParam()->dot_products(descriptor.data() + shift, descriptors.data() + 64 - shift, 5,
                             products.data());
    scalar().dot_products(descriptor.data() + shift, descriptors.data() + 64 - shift, 5,
                          expected.data());
    EXPECT_EQ(products, expected) << "from byte " << shift;
  }
}

TEST_P(EveryKernel, SumsTheMinimaOfEachPairOfCounts) {
  for (std::size_t k = 0; k < kBlockCounts; ++k) {
    std::vector<std::uint8_t> one(kBlockCounts, 0);
    one[k] = 100;
    std::vector<std::uint8_t> rising(kBlockCounts);
    for (std::size_t i = 0; i < kBlockCounts; ++i) rising[i] = static_cast<std::uint8_t>(i);
    ASSERT_EQ(max_min_sums(*GetParam(), one, rising).front(), std::min<std::size_t>(k, 100));
    ASSERT_EQ(max_min_sums(*GetParam(), rising, one).front(), std::min<std::size_t>(k, 100));
  }
}

TEST_P(EveryKernel, SumsTheLargestCounts) {
  for (const std::size_t records : {1U, 4U, 5U}) {
    const std::vector<std::uint8_t> largest(records * kBlockCounts, 127);
    const std::vector<std::uint16_t> sums(records, 127 * kBlockCounts);
    EXPECT_EQ(max_min_sums(*GetParam(), largest, largest), sums);
    EXPECT_EQ(max_min_sums(*GetParam(), {}, largest), std::vector<std::uint16_t>(records, 0));
    EXPECT_TRUE(max_min_sums(*GetParam(), largest, {}).empty());
  }
}

TEST_P(EveryKernel, SumsOfMinimaEqualTheScalarOnes) {
  Random random;
  for (const int largest : {3, 32, 127}) {
    for (const std::size_t num_queries : {1U, 2U, 3U, 4U, 5U, 9U, 65U}) {
      for (const std::size_t num_records : {1U, 2U, 3U, 4U, 5U, 16U, 33U}) {
        const auto queries = random_counts(random, num_queries, largest);
        const auto records = random_counts(random, num_records, largest);
        ASSERT_EQ(max_min_sums(*GetParam(), queries, records),
                  max_min_sums(scalar(), queries, records))
            << num_queries << " queries, " << num_records << " records, up to " << largest;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, EveryKernel,
                         testing::ValuesIn(available_kernels().begin(), available_kernels().end()),
                         [](const auto& kernels) { return std::string(kernels.param->name); });

TEST(Kernels, ScalarIsAlwaysThereAndFirst) { EXPECT_EQ(scalar().name, "scalar"); }

TEST(Kernels, ActiveIsTheFastestUnlessAnotherIsForced) {
  const char* forced = std::getenv("LOOPBIT_KERNEL");
  EXPECT_EQ(active_kernels().name, forced == nullptr ? available_kernels().back()->name : forced);
}

}  // namespace
}  // namespace loopbit::test
