// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include <CLI/CLI.hpp>

namespace loopbit::cli {

/// Replaces CLI::Range, which accepts nan and has a misleading message for 2.5 in 1 to 9.
CLI::Validator whole_number(std::int64_t min, std::int64_t max);
CLI::Validator number(double min, double max);

}  // namespace loopbit::cli
