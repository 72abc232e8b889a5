// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "ray_blocks.hpp"

namespace loopbit {

RayBlocks::RayBlocks(std::size_t size)
    : size_(size),
      stride_((size + kRayBlock - 1) / kRayBlock * kRayBlock),
      numbers_(RayArrays::kNumbers * stride_) {}

RayBlocks::RayBlocks(std::span<const RayPair> pairs) : RayBlocks(pairs.size()) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    float* to = numbers_.data() + i;
    for (const Ray* ray : {&pairs[i].query, &pairs[i].match}) {
      for (const double value : ray->direction.val) {
        *to = static_cast<float>(value);
        to += stride_;
      }
      for (const double value : ray->spread.val) {
        *to = static_cast<float>(value);
        to += stride_;
      }
    }
  }
}

RayBlocks::RayBlocks(const RayBlocks& from, std::span<const std::size_t> chosen)
    : RayBlocks(chosen.size()) {
  for (std::size_t row = 0; row < RayArrays::kNumbers; ++row) {
    const float* of = from.numbers_.data() + row * from.stride_;
    float* to = numbers_.data() + row * stride_;
    for (std::size_t i = 0; i < chosen.size(); ++i) to[i] = of[chosen[i]];
  }
}

}  // namespace loopbit
