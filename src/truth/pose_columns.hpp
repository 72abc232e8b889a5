// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace loopbit::truth {

// Numbers in a row of poses, by which a file's format is told.
inline constexpr std::size_t kTumColumns = 8;
inline constexpr std::size_t kKittiColumns = 12;
inline constexpr std::size_t kEurocColumns = 17;

}  // namespace loopbit::truth
