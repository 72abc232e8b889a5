// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// One thread adds places while others ask. Links no more than the index, so that a build with the
// thread sanitizer takes seconds.
#include <atomic>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "loopbit/place_index.hpp"

namespace loopbit::test {
namespace {

/// A camera's way: each content is the one before with some bits changed.
std::vector<BinaryContent> coherent_contents(std::size_t num_contents) {
  std::mt19937_64 random(2019);
  std::vector<BinaryContent> contents(num_contents);
  for (std::uint64_t& row : contents[0].rows) {
    const std::uint64_t bits = random();
    row = bits & random();
  }
  for (std::size_t i = 1; i < num_contents; ++i) {
    contents[i] = contents[i - 1];
    for (int change = 0; change < 20; ++change) {
      contents[i].rows[random() % 64] ^= std::uint64_t{1} << (random() % 64);
    }
  }
  return contents;
}

struct Answer {
  std::size_t query = 0;
  PlaceId end = 0;
  std::vector<Candidate> candidates;
};

TEST(Concurrency, ReadersSeeWholePlacesWhileOneWrites) {
  constexpr std::size_t kPlaces = 4'000;
  constexpr std::size_t kAnswers = 200;  // checked, of each reader
  const auto contents = coherent_contents(kPlaces);
  PlaceIndex index;
  index.add(contents[0]);

  std::atomic<bool> is_done = false;
  std::vector<std::vector<Answer>> answers(3);
  std::vector<std::thread> readers;
  for (std::size_t reader = 0; reader < answers.size(); ++reader) {
    readers.emplace_back([&, reader] {
      for (std::size_t query = reader; !is_done; query = (query * 7 + 1) % kPlaces) {
        const PlaceId end = index.size();
        Answer answer{query, end, index.query(contents[query], end)};
        if (answers[reader].size() < kAnswers) answers[reader].push_back(std::move(answer));
        EXPECT_EQ(index.content(end - 1), contents[static_cast<std::size_t>(end) - 1]);
      }
    });
  }
  for (std::size_t i = 1; i < kPlaces; ++i) {
    index.add(contents[i]);
    if (i % 16 == 0) std::this_thread::yield();
  }
  is_done = true;
  for (std::thread& reader : readers) reader.join();

  for (const auto& of_reader : answers) {
    for (const Answer& answer : of_reader) {
      ASSERT_EQ(index.query(contents[answer.query], answer.end), answer.candidates)
          << "query " << answer.query << ", end " << answer.end;
    }
  }
}

}  // namespace
}  // namespace loopbit::test
