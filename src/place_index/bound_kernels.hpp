// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "loopbit/instruction_set.hpp"

namespace loopbit {

/// Block counts in [0, 16] in one record, which packs them in 4 bits, where 15 stands for 16: its
/// byte 32 p + k has count 64 p + k in the lower bits, and count 64 p + 32 + k in the upper ones.
inline constexpr std::size_t kBlockCounts = 256;
inline constexpr std::size_t kPackedBytes = kBlockCounts / 2;
inline constexpr std::size_t kPackedRun = 32;
/// 8-bit counts in one record of coarse counts, and records that lie interleaved: the first four
/// counts of each record, then the next four of each, and so on.
inline constexpr std::size_t kCoarseCounts = 64;
inline constexpr std::size_t kInterleaved = 16;
inline constexpr std::size_t kCountsAtOnce = 4;

/// What several queries reach with one record.
struct Reached {
  std::uint16_t largest_sum;
  std::uint16_t queries;  ///< a bit for each that has the least sum that is needed
};

/// Which records to select: those whose largest sum is at least `lower` and below `upper`, both at
/// most 32,767, and that some query reaches. A query reaches record i if its sum is at least
/// max(query_count, smallest_counts[i]) * floor / 65,536, rounded down.
struct Selection {
  std::uint16_t lower = 0;
  std::uint16_t upper = 0;
  std::uint16_t query_count = 0;
  std::uint16_t floor = 0;
  const std::uint16_t* smallest_counts = nullptr;
};
struct Selected {
  std::uint16_t record;
  std::uint16_t queries;  ///< a bit for each that reaches it
};

/// The inner loops of PrunedSearch, for one instruction set.
struct BoundKernels {
  template <InstructionSet>
  static const BoundKernels& compiled_for();

  /// Which queries reach what a record needs; each query has its 256 block counts in bytes, in
  /// order, each record packs them. Of the queries q < 16 whose bit is set in among[i / 2], bit q
  /// of reached[i].queries is set where the sum over k of min(count k of q, count k of record i) is
  /// at least least[i]; reached[i].largest_sum is the largest of these sums.
  /// Cost: for each of these queries and each two records, 512 bytes of minimum and sum.
  void (*reaching_queries)(const std::uint8_t* queries, const std::uint16_t* among,
                           const std::uint8_t* const* records, std::size_t num_records,
                           const std::uint16_t* least, Reached* reached);

  /// All such sums of coarse counts in [0, 64]: each query has its 64 in order, the records come in
  /// groups of 16 interleaved ones. sums[(g * num_queries + q) * 16 + i] belongs to query q and
  /// record i of group g, and largest[g] is the largest of group g.
  /// Cost: num_queries * num_groups * 1 KB of minimum and sum, less where no query has a count.
  void (*coarse_sums)(const std::uint8_t* queries, std::size_t num_queries,
                      const std::uint8_t* groups, std::size_t num_groups, std::uint16_t* sums,
                      std::uint16_t* largest);

  /// The records, in order, that such sums of at most 16 queries and 4,096 groups leave; returns
  /// how many there are. `selected` has room for all.
  std::size_t (*select_records)(const std::uint16_t* sums, const std::uint16_t* largest,
                                std::size_t num_queries, std::size_t num_groups,
                                const Selection& selection, Selected* selected);
};

}  // namespace loopbit
