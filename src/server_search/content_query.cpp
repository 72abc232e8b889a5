// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "content_query.hpp"

#include <algorithm>
#include <cstring>
#include <exception>

#include "loopbit/binary_content.hpp"
#include "loopbit/kernels_for.hpp"

#include "block_counts.hpp"
#include "query_shifts.hpp"

namespace loopbit::server {
namespace {

static_assert(ContentQuery::kMaxGroups == kMaxShiftGroups);
static_assert(sizeof(BinaryContent) == kContentBytes);

BinaryContent content_at(const void* bytes) {
  BinaryContent content;
  std::memcpy(content.rows.data(), bytes, kContentBytes);
  return content;
}

template <typename Kernels>
const Kernels& kernels() noexcept {
  return kernels_for<Kernels>(active_instruction_set());  // prepare() has asked for it before
}

std::uint8_t larger_nibbles(std::uint8_t a, std::uint8_t b) {
  const int upper = std::max(a & 0xF0, b & 0xF0);
  return static_cast<std::uint8_t>(upper | std::max(a & 0x0F, b & 0x0F));
}

}  // namespace

bool prepare(const void* content, int tolerance_columns, ContentQuery& query) noexcept {
  try {
    static_cast<void>(active_instruction_set());
    const BinaryContent unshifted = content_at(content);
    const QueryShifts shifts(unshifted, tolerance_columns);
    query.tolerance_columns = tolerance_columns;
    query.count = static_cast<std::uint16_t>(loopbit::count(unshifted));
    query.content = unshifted.rows;
    query.num_shifts = shifts.shifted.size();
    query.num_groups = shifts.group_counts.size();
    for (std::size_t i = 0; i < query.num_shifts; ++i) query.shifted[i] = shifts.shifted[i].rows;
    for (std::size_t i = 0; i < query.num_groups; ++i) {
      query.block_counts[i] = shifts.group_counts[i].of;
      query.coarse_counts[i] = shifts.coarse_counts[i].of;
    }
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

int count(const void* content) noexcept { return loopbit::count(content_at(content)); }

void max_overlaps(const ContentQuery& query, const void* places, std::size_t num_places,
                  std::uint16_t* overlaps) noexcept {
  kernels<OverlapKernels>().max_overlaps(query.shifted.front().data(), query.num_shifts,
                                         static_cast<const std::uint64_t*>(places), num_places,
                                         overlaps);
}

void coarse_sums(const ContentQuery& query, const std::uint8_t* groups, std::size_t num_groups,
                 std::uint16_t* sums, std::uint16_t* largest) noexcept {
  kernels<BoundKernels>().coarse_sums(query.coarse_counts.front().data(), query.num_groups, groups,
                                      num_groups, sums, largest);
}

void bound_overlaps(const ContentQuery& query, const std::uint8_t* const* records,
                    std::size_t num_records, std::uint16_t* largest) noexcept {
  std::array<std::uint16_t, kMaxRecords / 2> all{};
  all.fill(static_cast<std::uint16_t>((1U << query.num_groups) - 1));
  const std::array<std::uint16_t, kMaxRecords> least{};
  std::array<Reached, kMaxRecords> reached{};
  kernels<BoundKernels>().reaching_queries(query.block_counts.front().data(), all.data(), records,
                                           num_records, least.data(), reached.data());
  for (std::size_t i = 0; i < num_records; ++i) largest[i] = reached[i].largest_sum;
}

// NOLINTNEXTLINE(readability-non-const-parameter): they are written to
void raise_bounds(const void* content, std::uint8_t* packed_record, std::uint8_t* coarse_group,
                  std::size_t number) noexcept {
  const BlockCounts blocks = block_counts(content_at(content));
  const PackedCounts counts = packed(blocks);
  std::transform(counts.of.begin(), counts.of.end(), packed_record, packed_record, larger_nibbles);
  const CoarseCounts coarse = coarse_counts(blocks);
  for (std::size_t k = 0; k < kCoarseCounts; ++k) {
    const std::size_t first = k / kCountsAtOnce * kCountsAtOnce;
    std::uint8_t& largest = coarse_group[first * kInterleaved + number * kCountsAtOnce + k - first];
    largest = std::max(largest, coarse.of[k]);
  }
}

}  // namespace loopbit::server
