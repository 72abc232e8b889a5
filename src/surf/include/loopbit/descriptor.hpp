// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace loopbit {

/// Values in one descriptor.
inline constexpr std::size_t kDescriptorSize = 64;

/// A unit-length SURF descriptor, each value times 127 / 0.5 and rounded; larger ones are cut off.
using Descriptor = std::array<std::int8_t, kDescriptorSize>;

}  // namespace loopbit
