// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include <CLI/CLI.hpp>

namespace loopbit::cli {

/// CLI::Range, which takes nan, and says of 2.5 that it is not between 1 and 9.
CLI::Validator whole_number(std::int64_t min, std::int64_t max);
CLI::Validator number(double min, double max);

}  // namespace loopbit::cli
