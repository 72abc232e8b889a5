// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace loopbit {

/// 64-bit words in one binary content.
inline constexpr std::size_t kContentWords = 64;
/// 8-bit counts in one record of block counts.
inline constexpr std::size_t kBlockCounts = 128;
/// 8-bit values in one descriptor.
inline constexpr std::size_t kDescriptorSize = 64;

/// The inner loops that decide the speed of loopbit, for one instruction set. All of them
/// return the same integers; the scalar one is the reference.
struct Kernels {
  std::string_view name;

  /// overlaps[i] = max over q of |queries[q] & places[i]|, each content 64 words.
  /// Cost: num_queries * num_places * 512 bytes of AND and popcount.
  void (*max_overlaps)(const std::uint64_t* queries, std::size_t num_queries,
                       const std::uint64_t* places, std::size_t num_places,
                       std::uint16_t* overlaps);

  /// products[i] = dot(descriptor, descriptors[i]), each descriptor 64 signed bytes in [-127, 127].
  void (*dot_products)(const std::int8_t* descriptor, const std::int8_t* descriptors,
                       std::size_t num_descriptors, std::int32_t* products);

  /// largest[i] = max over q of the sum over k of min(queries[q][k], records[i][k]), each of the
  /// queries and of the records 128 counts in [0, 127].
  /// Cost: num_queries * num_records * 128 bytes of minimum and sum.
  void (*max_min_sums)(const std::uint8_t* queries, std::size_t num_queries,
                       const std::uint8_t* records, std::size_t num_records,
                       std::uint16_t* largest);
};

/// The kernels this processor can run, slowest first: "scalar", "avx2", "avx512".
std::span<const Kernels* const> available_kernels();

/// The fastest of them, or the one that the environment variable LOOPBIT_KERNEL names (unless
/// empty) when it is first called. Throws Error (kind option) if that one is unknown or cannot run
/// here.
const Kernels& active_kernels();

}  // namespace loopbit
