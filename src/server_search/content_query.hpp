// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "bound_kernels.hpp"
#include "overlap_kernels.hpp"

// The library's side of the extension. Nothing here knows PostgreSQL, throws, or leaves memory
// behind, so that PostgreSQL's errors, which are jumps, pass over nothing that has a destructor.

namespace loopbit::server {

inline constexpr std::size_t kContentBytes = kContentWords * sizeof(std::uint64_t);
inline constexpr int kMaxTolerance_columns = 32;
inline constexpr int kDefaultTolerance_columns = 4;

/// A content at all tolerated shifts, which places are compared with.
struct ContentQuery {
  /// Even numbers of columns up to the tolerance, either way.
  static constexpr std::size_t kMaxShifts = kMaxTolerance_columns + 1;
  static constexpr std::size_t kMaxGroups = 16;

  using Content = std::array<std::uint64_t, kContentWords>;

  int tolerance_columns;
  std::uint16_t count;  ///< |O| before shifting
  std::size_t num_shifts;
  std::size_t num_groups;  ///< of shifts that are bounded together
  Content content;
  std::array<Content, kMaxShifts> shifted;
  std::array<std::array<std::uint8_t, kBlockCounts>, kMaxGroups> block_counts;
  std::array<std::array<std::uint8_t, kCoarseCounts>, kMaxGroups> coarse_counts;
};

/// `content`: 512 bytes at any address. False if there is no memory, or if LOOPBIT_KERNEL names no
/// instruction set of this processor.
[[nodiscard]] bool prepare(const void* content, int tolerance_columns,
                           ContentQuery& query) noexcept;

[[nodiscard]] int count(const void* content) noexcept;

// The three below: after prepare() has succeeded.

/// The most pixels that each of `num_places` contents, at an address that is a multiple of 8,
/// shares with the query.
void max_overlaps(const ContentQuery& query, const void* places, std::size_t num_places,
                  std::uint16_t* overlaps) noexcept;

/// See BoundKernels::coarse_sums. `sums`: num_groups * 16 for each of the groups of records.
void coarse_sums(const ContentQuery& query, const std::uint8_t* groups, std::size_t num_groups,
                 std::uint16_t* sums, std::uint16_t* largest) noexcept;

/// Of each record of packed counts, the most pixels that a place it bounds can share with the
/// query; at most kMaxRecords.
inline constexpr std::size_t kMaxRecords = 64;
void bound_overlaps(const ContentQuery& query, const std::uint8_t* const* records,
                    std::size_t num_records, std::uint16_t* largest) noexcept;

/// The similarity of a place with this overlap and |O|.
[[nodiscard]] inline double similarity(const ContentQuery& query, int overlap,
                                       int place_count) noexcept {
  const int larger = place_count > query.count ? place_count : query.count;
  return larger == 0 ? 0.0 : static_cast<double>(overlap) / larger;
}

/// Raises the bounds of a stretch to include a content: its packed record, and record `number` of
/// its interleaved group of coarse counts.
void raise_bounds(const void* content, std::uint8_t* packed_record, std::uint8_t* coarse_group,
                  std::size_t number) noexcept;

}  // namespace loopbit::server
