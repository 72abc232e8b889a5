// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

namespace loopbit::datasets {

/// The number that is all of `text`. None if it is something else, out of range or not finite.
template <typename Number>
std::optional<Number> parse_number(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(number)) return std::nullopt;
  }
  return number;
}

/// The frame number that is all of `text`: from 0.
std::optional<int> parse_frame(std::string_view text);

/// Replaces `cells` by the cells of `row`, without space at their ends: between commas where there
/// are any (a cell may then be empty), else between spaces and tabs. They refer to `row`.
void split_cells(std::string_view row, std::vector<std::string_view>& cells);

/// True of a row that can only name columns: each cell begins with a letter.
bool are_names(const std::vector<std::string_view>& cells);

}  // namespace loopbit::datasets
