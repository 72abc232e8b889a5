// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Functions that need no image. server_search compiles this file, too, without OpenCV's libraries.
#include <algorithm>
#include <bit>
#include <cassert>
#include <cstdlib>

#include "loopbit/binary_content.hpp"
#include "loopbit/kernels_for.hpp"

#include "overlap_kernels.hpp"

namespace loopbit {
namespace {

int overlap(std::span<const BinaryContent> queries, const BinaryContent& place) {
  std::uint16_t most = 0;
  max_overlaps(queries, std::span(&place, 1), std::span(&most, 1));
  return most;
}

}  // namespace

int count(const BinaryContent& content) { return overlap(std::span(&content, 1), content); }

cv::Point2d center(const BinaryContent& content) {
  std::int64_t sum_x = 0;
  std::int64_t sum_y = 0;
  std::int64_t set = 0;
  for (int y = 0; y < kContentSide; ++y) {
    const std::uint64_t row = content.rows[static_cast<std::size_t>(y)];
    set += std::popcount(row);
    sum_y += std::int64_t{y} * std::popcount(row);
    for (std::uint64_t bits = row; bits != 0; bits &= bits - 1) sum_x += std::countr_zero(bits);
  }
  if (set == 0) return {(kContentSide - 1) / 2.0, (kContentSide - 1) / 2.0};
  const auto n = static_cast<double>(set);
  return {static_cast<double>(sum_x) / n, static_cast<double>(sum_y) / n};
}

BinaryContent shift_columns(const BinaryContent& content, int columns) {
  if (std::abs(columns) >= kContentSide) return {};
  BinaryContent shifted;
  std::transform(
      content.rows.begin(), content.rows.end(), shifted.rows.begin(),
      [&](std::uint64_t row) { return columns >= 0 ? row << columns : row >> -columns; });
  return shifted;
}

std::vector<BinaryContent> tolerated_shifts(const BinaryContent& content, int tolerance_columns) {
  std::vector<BinaryContent> shifted;
  for (int columns = -tolerance_columns; columns <= tolerance_columns; ++columns) {
    if (columns % 2 != 0 && std::abs(columns) != tolerance_columns) continue;
    shifted.push_back(shift_columns(content, columns));
  }
  return shifted;
}

double similarity(const BinaryContent& a, const BinaryContent& b, int shift_tolerance_columns) {
  const int larger = std::max(count(a), count(b));
  if (larger == 0) return 0.0;
  return static_cast<double>(overlap(tolerated_shifts(a, shift_tolerance_columns), b)) / larger;
}

void max_overlaps(std::span<const BinaryContent> queries, std::span<const BinaryContent> places,
                  std::span<std::uint16_t> overlaps, InstructionSet instruction_set) {
  static_assert(sizeof(BinaryContent) == kContentWords * sizeof(std::uint64_t));
  assert(overlaps.size() >= places.size());
  const auto words = [](std::span<const BinaryContent> contents) {
    return reinterpret_cast<const std::uint64_t*>(contents.data());
  };
  kernels_for<OverlapKernels>(instruction_set)
      .max_overlaps(words(queries), queries.size(), words(places), places.size(), overlaps.data());
}

}  // namespace loopbit
