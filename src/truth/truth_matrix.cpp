// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "truth_matrix.hpp"

#include <algorithm>
#include <bit>
#include <cassert>

#include <fmt/format.h>

#include "loopbit/error.hpp"

#include "truth_rows.hpp"

namespace loopbit::truth {
namespace {

constexpr std::size_t kWordBits = 64;

}  // namespace

TruthMatrix::TruthMatrix(const std::string& thing, Shape shape, int views)
    : views_(static_cast<std::size_t>(views)) {
  assert(views > 0);
  const auto [rows, columns] = shape;
  if (rows != columns) {
    throw Error(ErrorKind::input,
                fmt::format("{} has {} rows and {} columns, but ground truth has "
                            "one row and one column per frame: give a square matrix.",
                            thing, rows, columns));
  }
  if (rows > kMaxRows) {
    throw Error(ErrorKind::input,
                fmt::format("{} has {} rows, but at most {} are read: leave out frames, or give "
                            "rows of query,first,last.",
                            thing, rows, kMaxRows));
  }
  if (rows % views_ != 0) {
    throw Error(
        ErrorKind::input,
        fmt::format("{} has {} rows, which is not a multiple of {} views per frame: give another "
                    "number of views.",
                    thing, rows, views));
  }
  places_.resize(rows / views_);
}

void TruthMatrix::add(std::size_t row, std::size_t column) {
  const auto [place, query] = std::minmax({row / views_, column / views_});
  assert(query < places_.size());
  if (place == query) return;
  auto& words = places_[query];
  if (words.empty()) words.resize((query + kWordBits - 1) / kWordBits);
  words[place / kWordBits] |= std::uint64_t{1} << place % kWordBits;
}

std::vector<PlaceRun> TruthMatrix::runs() const {
  std::vector<PlaceRun> runs;
  for (std::size_t query = 0; query < places_.size(); ++query) {
    for (std::size_t i = 0; i < places_[query].size(); ++i) {
      for (std::uint64_t word = places_[query][i]; word != 0; word &= word - 1) {
        const auto bit = static_cast<std::size_t>(std::countr_zero(word));
        const int place = static_cast<int>(i * kWordBits + bit);
        add_places(runs, {static_cast<int>(query), place, place});
      }
    }
  }
  return runs;
}

}  // namespace loopbit::truth
