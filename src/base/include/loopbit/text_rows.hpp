// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

namespace loopbit {

/// One line of a text file that says something.
struct TextRow {
  std::size_t line;  ///< from 1
  std::string text;  ///< without space at its ends
};

/// All rows of `file` but blank ones and those that begin with `#`. Line ends may be LF or CRLF,
/// and a byte order mark is dropped. Throws as read_text() does.
std::vector<TextRow> read_rows(const std::filesystem::path& file);

/// As read_rows(); but where `file` holds NUL bytes, as `find -print0` writes them, these alone end
/// a row, and rows are taken as they stand.
std::vector<TextRow> read_listed_rows(const std::filesystem::path& file);

/// Without spaces, tabs and carriage returns at its ends.
std::string_view trimmed(std::string_view text);

/// Throws Error (kind input) that names file, line and text, and says that each row must be `rule`.
[[noreturn]] void throw_bad_row(const std::filesystem::path& file, const TextRow& row,
                                std::string_view rule);

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

}  // namespace loopbit
