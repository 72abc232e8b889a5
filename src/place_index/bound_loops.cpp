// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
// Compiled once for each instruction set that has no source of its own, see loopbit_kernels().
#include "bound_kernels.hpp"

namespace loopbit {
namespace {

/// The smaller of a count and one that is packed in 4 bits.
unsigned smaller(unsigned count, unsigned packed) {
  return packed == 15 || count < packed ? count : packed;
}

/// The sum of the minima of a query and a packed record.
unsigned packed_sum(const std::uint8_t* query, const std::uint8_t* record) {
  unsigned sum = 0;
  for (std::size_t byte = 0; byte < kPackedBytes; ++byte) {
    const std::size_t lower = byte + byte / kPackedRun * kPackedRun;
    const unsigned packed = record[byte];
    sum += smaller(query[lower], packed & 15U) + smaller(query[lower + kPackedRun], packed >> 4U);
  }
  return sum;
}

void reaching_queries(const std::uint8_t* queries, const std::uint16_t* among,
                      const std::uint8_t* const* records, std::size_t num_records,
                      const std::uint16_t* least, Reached* reached) {
  for (std::size_t i = 0; i < num_records; ++i) {
    const unsigned asked = among[i / 2];
    unsigned best = 0;
    unsigned bits = 0;
    for (std::size_t q = 0; asked >> q != 0; ++q) {
      if ((asked >> q & 1U) == 0) continue;
      const unsigned sum = packed_sum(queries + q * kBlockCounts, records[i]);
      best = sum > best ? sum : best;
      if (sum >= least[i]) bits |= 1U << q;
    }
    reached[i] = {static_cast<std::uint16_t>(best), static_cast<std::uint16_t>(bits)};
  }
}

/// The sum of the minima with record i of an interleaved group.
unsigned coarse_sum(const std::uint8_t* query, const std::uint8_t* group, std::size_t i) {
  unsigned sum = 0;
  for (std::size_t k = 0; k < kCoarseCounts; ++k) {
    const std::size_t first = k / kCountsAtOnce * kCountsAtOnce;
    const std::uint8_t count = group[first * kInterleaved + i * kCountsAtOnce + k - first];
    sum += query[k] < count ? query[k] : count;
  }
  return sum;
}

void coarse_sums(const std::uint8_t* queries, std::size_t num_queries, const std::uint8_t* groups,
                 std::size_t num_groups, std::uint16_t* sums, std::uint16_t* largest) {
  for (std::size_t group = 0; group < num_groups; ++group) {
    unsigned best = 0;
    for (std::size_t q = 0; q < num_queries; ++q) {
      for (std::size_t i = 0; i < kInterleaved; ++i) {
        const unsigned sum = coarse_sum(queries + q * kCoarseCounts,
                                        groups + group * kInterleaved * kCoarseCounts, i);
        sums[(group * num_queries + q) * kInterleaved + i] = static_cast<std::uint16_t>(sum);
        best = sum > best ? sum : best;
      }
    }
    largest[group] = static_cast<std::uint16_t>(best);
  }
}

std::size_t select_records(const std::uint16_t* sums, const std::uint16_t* largest,
                           std::size_t num_queries, std::size_t num_groups,
                           const Selection& selection, Selected* selected) {
  std::size_t num_selected = 0;
  for (std::size_t group = 0; group < num_groups; ++group) {
    if (largest[group] < selection.lower) continue;
    for (std::size_t i = 0; i < kInterleaved; ++i) {
      const std::size_t record = group * kInterleaved + i;
      const unsigned smallest = selection.smallest_counts[record];
      const unsigned larger = smallest > selection.query_count ? smallest : selection.query_count;
      const unsigned need = larger * selection.floor >> 16U;
      unsigned best = 0;
      unsigned bits = 0;
      for (std::size_t q = 0; q < num_queries; ++q) {
        const unsigned sum = sums[(group * num_queries + q) * kInterleaved + i];
        best = sum > best ? sum : best;
        if (sum >= need) bits |= 1U << q;
      }
      if (best < selection.lower || best >= selection.upper || bits == 0) continue;
      selected[num_selected++] = {static_cast<std::uint16_t>(record),
                                  static_cast<std::uint16_t>(bits)};
    }
  }
  return num_selected;
}

constexpr BoundKernels kBoundKernels{reaching_queries, coarse_sums, select_records};

}  // namespace

template <InstructionSet>
const BoundKernels& BoundKernels::compiled_for() {
  return kBoundKernels;
}
template const BoundKernels& BoundKernels::compiled_for<InstructionSet::LOOPBIT_INSTRUCTION_SET>();

}  // namespace loopbit
