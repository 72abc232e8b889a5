// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "crc32.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

#include "test_support.hpp"

namespace loopbit::test {
namespace {

std::vector<unsigned char> random_bytes(std::size_t size) {
  Random random;
  std::vector<unsigned char> bytes(size);
  std::generate(bytes.begin(), bytes.end(),
                [&] { return static_cast<unsigned char>(random.between(0, 255)); });
  return bytes;
}

TEST(Crc32, IsThatOfItsStandard) {
  constexpr std::string_view kText = "123456789";
  const std::span bytes(reinterpret_cast<const unsigned char*>(kText.data()), kText.size());
  EXPECT_EQ(crc32_of(0, bytes), 0xcbf43926U);
  EXPECT_EQ(crc32_of(7, {}), 7U);
}

TEST(Crc32, IsZlibsForEverySizeAndAlignment) {
  const auto bytes = random_bytes(1100);
  for (std::size_t size = 0; size < 1080; ++size) {
    const unsigned char* begin = bytes.data() + size % 17;
    ASSERT_EQ(crc32_of(0, {begin, size}), crc32_z(0, begin, size)) << size;
  }
}

TEST(Crc32, GoesOnWhereItWas) {
  const auto bytes = random_bytes(5000);
  const std::span all(bytes);
  const std::uint32_t whole = crc32_of(0, all);
  EXPECT_EQ(whole, crc32_z(0, bytes.data(), bytes.size()));
  for (std::size_t cut = 0; cut <= bytes.size(); cut += 61) {
    ASSERT_EQ(crc32_of(crc32_of(0, all.first(cut)), all.subspan(cut)), whole) << cut;
  }
}

}  // namespace
}  // namespace loopbit::test
