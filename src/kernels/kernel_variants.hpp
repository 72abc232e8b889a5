// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "loopbit/kernels.hpp"

namespace loopbit {

/// Kernels::max_overlaps on top of one variant's `overlap`, which must have internal linkage: code
/// compiled for one instruction set may not be shared with a file compiled for another. For the
/// same reason nothing inline from the standard library is called here or in the variants.
template <int (*overlap)(const std::uint64_t*, const std::uint64_t*)>
void max_overlaps(const std::uint64_t* queries, std::size_t num_queries,
                  const std::uint64_t* places, std::size_t num_places, std::uint16_t* overlaps) {
  for (std::size_t i = 0; i < num_places; ++i) {
    int best = 0;
    for (std::size_t q = 0; q < num_queries; ++q) {
      const int both = overlap(queries + q * kContentWords, places + i * kContentWords);
      best = both > best ? both : best;
    }
    overlaps[i] = static_cast<std::uint16_t>(best);
  }
}

extern const Kernels kScalarKernels;
#if defined(__x86_64__)
extern const Kernels kAvx2Kernels;    ///< needs AVX2
extern const Kernels kAvx512Kernels;  ///< needs AVX-512 F, BW, DQ, VL, VNNI and VPOPCNTDQ
#elif defined(__aarch64__)
extern const Kernels kDotprodKernels;  ///< needs Armv8.2-A and the dot product extension
#endif

}  // namespace loopbit
