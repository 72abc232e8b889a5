// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace loopbit::datasets {

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

}  // namespace loopbit::datasets
