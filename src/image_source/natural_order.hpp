// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace loopbit::images {

/// Runs of digits count as numbers: 2.png comes before 10.png. Names that differ in leading zeros
/// only are ordered byte by byte, so that the order is total.
bool natural_less(std::string_view a, std::string_view b);

}  // namespace loopbit::images
