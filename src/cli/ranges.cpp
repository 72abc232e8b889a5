// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "ranges.hpp"

#include <string>

#include <fmt/format.h>

namespace loopbit::cli {
namespace {

template <typename Number>
CLI::Validator range(Number min, Number max, const char* type, const char* kind) {
  const auto check = [=](const std::string& text) {
    Number value{};
    const bool is_number = CLI::detail::lexical_cast(text, value);
    if (is_number && value >= min && value <= max) return std::string();
    return fmt::format("'{}' is not a {} from {} to {}", text, kind, min, max);
  };
  return {check, fmt::format("{} in [{} - {}]", type, min, max)};
}

}  // namespace

CLI::Validator whole_number(std::int64_t min, std::int64_t max) {
  return range(min, max, "INT", "whole number");
}

CLI::Validator number(double min, double max) { return range(min, max, "FLOAT", "number"); }

}  // namespace loopbit::cli
